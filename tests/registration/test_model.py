from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.registration import RegistrationModel
from navapp.values import BoneModel
from tests.reference.lookup_reference import nearest_by_trying_all
from tests.registration.kernel_cases import find_vertices
from tests.registration.shapes import ball_mesh, blob, grid_mesh


def test_cartilage_moves_the_surface_out_and_widens_its_sigma() -> None:
    bone = blob()
    n = len(bone.mesh.vertices_mm)
    model = RegistrationModel(
        replace(bone, cartilage_mm=np.full(n, 2.0), cartilage_sd_mm=np.full(n, 0.5))
    )
    expected = bone.mesh.vertices_mm + 2.0 * bone.mesh.normals
    np.testing.assert_allclose(model.points_mm, expected, atol=1e-12)
    np.testing.assert_allclose(model.arrays.points, expected, atol=1e-12)
    np.testing.assert_allclose(model.seen_mesh.vertices_mm, expected, atol=1e-12)
    np.testing.assert_allclose(model.arrays.sigma, np.hypot(0.1, 0.5))
    np.testing.assert_allclose(model.centre_mm, bone.mesh.centroid_mm)


def test_where_cartilage_grows_thicker_the_seen_surface_leans() -> None:
    bone = BoneModel("plate", grid_mesh(lambda x, y: 0.0 * x, 20.0))
    along = bone.mesh.vertices_mm[:, 0]
    model = RegistrationModel(replace(bone, cartilage_mm=2.0 + 0.1 * along))
    expected = np.array([-0.1, 0.0, 1.0]) / np.hypot(0.1, 1.0)
    expected *= np.sign(bone.mesh.normals[0, 2])
    expected[0] *= np.sign(bone.mesh.normals[0, 2])
    np.testing.assert_allclose(model.normals, np.tile(expected, (len(along), 1)), atol=1e-9)
    np.testing.assert_array_equal(model.seen_mesh.normals, model.normals)
    np.testing.assert_array_equal(model.arrays.normals, model.normals)


def test_the_seen_surface_bends_as_it_is_seen() -> None:
    ball = ball_mesh(25.0, 800)
    n = len(ball.vertices_mm)
    bone = BoneModel("ball", ball, cartilage_mm=np.full(n, 3.0))
    seen = BoneModel("ball", TriangleMesh(ball.vertices_mm * 28.0 / 25.0, ball.faces))
    bends, expected = (RegistrationModel(b).arrays.curvature for b in (bone, seen))
    np.testing.assert_allclose(bends, expected, atol=1e-3)


def test_a_cloud_keeps_its_normals_under_cartilage() -> None:
    mesh = blob().mesh
    cloud = TriangleMesh(mesh.vertices_mm, np.empty((0, 3), dtype=np.int32), mesh.normals)
    bone = BoneModel("femur", cloud, cartilage_mm=np.ones(len(mesh.vertices_mm)))
    np.testing.assert_array_equal(RegistrationModel(bone).normals, mesh.normals)


def test_parts_that_were_cut_away_may_not_pair_and_are_not_seen() -> None:
    bone = blob()
    removed = bone.mesh.vertices_mm[:, 0] > 10.0
    model = RegistrationModel(replace(bone, is_removed=removed))
    np.testing.assert_array_equal(model.arrays.can_pair, ~removed)
    used = np.unique(model.seen_mesh.faces)
    assert not removed[used].any()
    assert len(used) > 0.9 * (~removed).sum()


def test_an_open_border_may_not_pair() -> None:
    mesh = grid_mesh(lambda x, y: 0.01 * x * x + 0.02 * y, 20.0)
    model = RegistrationModel(BoneModel("plate", mesh))
    is_rim = np.abs(mesh.vertices_mm[:, :2]).max(axis=1) > 19.9
    np.testing.assert_array_equal(model.arrays.can_pair, ~is_rim)


@pytest.mark.kernel
def test_a_cloud_with_normals_is_a_model_all_of_which_may_pair() -> None:
    mesh = blob().mesh
    no_faces = np.empty((0, 3), dtype=np.int32)
    cloud = TriangleMesh(mesh.vertices_mm, no_faces, mesh.normals)
    model = RegistrationModel(BoneModel("femur", cloud))
    assert model.arrays.can_pair.all()
    rng = np.random.default_rng(3)
    points = mesh.vertices_mm + rng.normal(0.0, 1.0, mesh.vertices_mm.shape)
    _, distance = find_vertices(points, model)
    _, least = nearest_by_trying_all(points, mesh.vertices_mm)
    assert (distance - least).max() < 0.3
    meshed = RegistrationModel(blob())
    inner = np.abs(model.arrays.curvature - meshed.arrays.curvature).max(axis=1)
    assert np.median(inner) < 0.005


@pytest.mark.kernel
def test_the_grid_reaches_beyond_the_bone_and_names_the_nearest_vertices() -> None:
    model = RegistrationModel(blob())
    grid = model.arrays.grid
    last = grid.origin + grid.voxel * (np.array(grid.nearest.shape) - 1)
    assert (grid.origin <= model.points_mm.min(axis=0) - 14.0).all()
    assert (last >= model.points_mm.max(axis=0) + 14.0).all()
    cells = np.random.default_rng(1).integers(0, grid.nearest.shape, (300, 3))
    centres = grid.origin + grid.voxel * cells
    expected, _ = nearest_by_trying_all(centres, model.points_mm)
    np.testing.assert_array_equal(grid.nearest[tuple(cells.T)], expected)


def test_a_huge_model_gets_larger_voxels_and_not_more_of_them() -> None:
    mesh = blob().mesh
    huge = TriangleMesh(1000.0 * mesh.vertices_mm, mesh.faces)
    grid = RegistrationModel(BoneModel("femur", huge)).arrays.grid
    assert grid.nearest.size < 500_000
    assert grid.voxel > 100.0


def test_the_arrays_are_made_once() -> None:
    model = RegistrationModel(blob())
    assert model.arrays is model.arrays
