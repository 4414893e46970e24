import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from navapp.geometry.mesh import TriangleMesh
from navapp.registration import RegistrationModel
from navapp.registration.lookup_kernels import VoxelGrid, fill_scene_grid
from navapp.values import BoneModel
from tests.reference import bimcc_reference as reference
from tests.reference.lookup_reference import nearest_by_trying_all
from tests.registration.kernel_cases import find_vertices
from tests.registration.shapes import blob, femur

MODEL = RegistrationModel(blob())


def points_near(spread_mm: float, n: int = 600) -> np.ndarray:
    rng = np.random.default_rng(5)
    chosen = rng.integers(0, len(MODEL.points_mm), n)
    return MODEL.points_mm[chosen] + rng.normal(0.0, spread_mm, (n, 3))


@pytest.mark.kernel
@pytest.mark.parametrize("spread_mm", [0.0, 0.3, 1.5, 4.0])
def test_the_nearest_vertex_is_found(spread_mm: float) -> None:
    points = points_near(spread_mm)
    index, distance = find_vertices(points, MODEL)
    expected, least = nearest_by_trying_all(points, MODEL.points_mm)
    # Descent may end beside the nearest one far from the surface; never by much.
    assert (index == expected).mean() > 0.99
    assert (distance - least).max() < 0.3


ONE_POINT = BoneModel("point", TriangleMesh(np.full((1, 3), 7.0), np.empty((0, 3), np.int32)))
CLOUD = BoneModel("cloud", TriangleMesh(blob().mesh.vertices_mm, np.empty((0, 3), np.int32)))


@pytest.mark.kernel
@pytest.mark.parametrize(
    "bone", [blob(), femur(), CLOUD, ONE_POINT], ids=["blob", "femur", "cloud", "point"]
)
def test_each_voxel_of_a_model_knows_the_nearest_vertex_or_almost(bone: BoneModel) -> None:
    model = RegistrationModel(bone)
    grid = model.arrays.grid
    cells = np.stack(np.indices(grid.nearest.shape), axis=-1).reshape(-1, 3)[::53]
    centres = grid.origin + grid.voxel * cells
    known = grid.nearest[tuple(cells.T)]
    least, _ = cKDTree(model.points_mm).query(centres)
    excess = np.linalg.norm(centres - model.points_mm[known], axis=1) - least
    assert (excess < 1e-9).mean() > 0.99
    assert excess.max() < 0.3


@pytest.mark.kernel
def test_a_point_outside_the_grid_gets_a_vertex_on_its_own_side() -> None:
    far = np.concatenate([500.0 * np.eye(3), -1e9 * np.eye(3)])
    _, distance = find_vertices(far, MODEL)
    _, least = nearest_by_trying_all(far, MODEL.points_mm)
    assert (distance - least < 0.05 * least).all()


def grid_of(points: np.ndarray, every: int, voxel_mm: float) -> VoxelGrid:
    low = points.min(axis=0) - voxel_mm
    shape = np.ceil((np.ptp(points, axis=0) + 2.0 * voxel_mm) / voxel_mm).astype(int) + 1
    grid = VoxelGrid(np.full(tuple(shape), -1, dtype=np.int32), low, voxel_mm)
    fill_scene_grid(points, every, grid)
    return grid


@pytest.mark.release
@pytest.mark.kernel
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 60),
    every=st.integers(1, 4),
    voxel_mm=st.floats(1.0, 9.0),
)
@settings(max_examples=25, deadline=None)
def test_the_scenes_grid_is_that_of_the_equations(
    seed: int, n: int, every: int, voxel_mm: float
) -> None:
    points = np.random.default_rng(seed).uniform(-10.0, 10.0, (n, 3))
    grid = grid_of(points, every, voxel_mm)
    expected = reference.fill_scene_grid(points, every, grid.nearest.shape, grid.origin, grid.voxel)
    np.testing.assert_array_equal(grid.nearest, expected)


@pytest.mark.kernel
def test_the_scenes_grid_knows_the_nearest_point_or_almost() -> None:
    points = points_near(1.0)
    every = 2
    grid = grid_of(points, every, 6.0)
    cells = np.stack(np.indices(grid.nearest.shape), axis=-1).reshape(-1, 3)
    centres = grid.origin + grid.voxel * cells
    known = grid.nearest.ravel()
    assert (known >= 0).all()
    assert (known % every == 0).all()
    _, least = nearest_by_trying_all(centres, points[::every])
    excess = (np.linalg.norm(centres - points[known], axis=1) - least)[least < 12.0]
    assert (excess < 1e-9).mean() > 0.65
    assert np.quantile(excess, 0.99) < 0.6 * grid.voxel
    assert excess.max() < grid.voxel


def test_beside_every_point_its_own_voxel_is_filled() -> None:
    points = points_near(1.0)
    grid = grid_of(points, 1, 6.0)
    cells = np.floor((points - grid.origin) / grid.voxel + 0.5).astype(int)
    found = grid.nearest[tuple(cells.T)]
    assert (found >= 0).all()
    assert np.linalg.norm(points - points[found], axis=1).max() < np.sqrt(3.0) * grid.voxel
