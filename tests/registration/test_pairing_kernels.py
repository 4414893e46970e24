import numpy as np
import pytest

from navapp.registration import RegistrationModel
from navapp.registration.pairing_kernels import (
    Pose,
    SceneArrays,
    make_pairs,
    measure_pairs,
    pair_backward,
    pair_forward,
)
from navapp.values import BoneModel
from tests.reference import bimcc_reference as reference
from tests.registration.kernel_cases import Case, as_pairs, make_case, measured_pairs
from tests.registration.shapes import ball_mesh

N_MODEL = 1500


def forward(case: Case, every: int) -> tuple[np.ndarray, np.ndarray]:
    pairs = make_pairs(len(case.scene.points))
    n = pair_forward(case.scene, case.model, case.pose, every, pairs)
    return pairs.scene[:n], pairs.vertex[:n]


def backward(case: Case, radius_mm: float, first: int = 0) -> tuple[np.ndarray, np.ndarray]:
    pairs = make_pairs(first + N_MODEL)
    n, _ = pair_backward(
        case.scene, case.grid, case.model, case.pose, 2, radius_mm, 0.2, pairs, first
    )
    assert (pairs.scene[:first] == 0).all()
    return pairs.scene[first:n], pairs.vertex[first:n]


@pytest.mark.kernel
@pytest.mark.parametrize("has_camera", [True, False])
@pytest.mark.parametrize("every", [1, 3])
def test_forward_pairs_are_those_of_the_reference(has_camera: bool, every: int) -> None:
    case = make_case(has_camera=has_camera)
    chosen, vertex = forward(case, every)
    expected = reference.pair_forward(case.scene, case.model, case.R, case.t, every)
    np.testing.assert_array_equal(chosen, expected[0])
    np.testing.assert_array_equal(vertex, expected[1])
    assert 20 < len(chosen) < -(-500 // every)


@pytest.mark.kernel
@pytest.mark.parametrize("has_camera", [True, False])
@pytest.mark.parametrize("radius_mm", [1.5, 9.0])
def test_backward_pairs_are_those_of_the_reference(has_camera: bool, radius_mm: float) -> None:
    case = make_case(has_camera=has_camera)
    found = backward(case, radius_mm, first=7)
    expected = reference.pair_backward(
        case.scene, case.grid, case.model, case.R, case.t, 2, radius_mm, 0.2
    )
    np.testing.assert_array_equal(found[0], expected[0])
    np.testing.assert_array_equal(found[1], expected[1])
    assert len(found[0]) > 15


def test_a_backward_pair_is_little_longer_than_the_shortest() -> None:
    case = make_case()
    chosen, vertex = backward(case, 9.0)
    places = (case.model.points[vertex] - case.t) @ case.R
    length = np.linalg.norm(places - case.scene.points[chosen], axis=1)
    used = case.scene.points[::2]
    least = np.linalg.norm(places[:, None] - used, axis=2).min(axis=1)
    assert length.max() <= 9.0
    assert (length - least).min() > -1e-9
    assert (length - least).max() < np.sqrt(3.0) * case.grid.voxel
    assert np.median(length - least) < 0.25 * case.grid.voxel


def test_what_was_cut_away_pairs_in_no_direction() -> None:
    case = make_case(has_camera=False)
    removed = ~case.model.can_pair
    assert removed.sum() > 20
    assert not removed[forward(case, 1)[1]].any()
    assert not removed[backward(case, 9.0)[1]].any()


@pytest.mark.kernel
def test_the_far_side_pairs_in_no_direction() -> None:
    case = make_case()
    cosine = reference.facing(case.model, case.camera)
    assert cosine[forward(case, 1)[1]].min() >= 0.0
    assert cosine[backward(case, 9.0)[1]].min() >= 0.2
    assert (cosine < 0.0).sum() > 500


def test_a_model_outside_the_scenes_grid_has_no_backward_pair() -> None:
    case = make_case(has_camera=False)
    case.t = case.t + np.array([300.0, 0.0, 0.0])
    assert len(backward(case, 1e6)[0]) == 0


@pytest.mark.parametrize("has_camera", [True, False])
@pytest.mark.parametrize("knows_noise", [True, False])
def test_pairs_are_measured_as_by_the_reference(has_camera: bool, knows_noise: bool) -> None:
    pairs, n, expected, _ = measured_pairs(
        make_case(has_camera=has_camera, knows_noise=knows_noise)
    )
    for name in ("point", "residual", "direction", "excess", "variance"):
        np.testing.assert_allclose(
            getattr(pairs, name)[:n], getattr(expected, name), rtol=1e-9, atol=1e-9
        )


@pytest.mark.kernel
def test_far_from_its_vertex_a_point_is_measured_against_the_plane() -> None:
    """Pairs of any length: both branches of the surface, and an excess."""
    case = make_case()
    rng = np.random.default_rng(3)
    chosen, vertex = rng.integers(0, 500, 400), rng.integers(0, N_MODEL, 400)
    pairs = as_pairs(chosen, vertex)
    measure_pairs(case.scene, case.model, case.pose, pairs, 400)
    expected = reference.measure_pairs(case.scene, case.model, case.R, case.t, chosen, vertex)
    np.testing.assert_allclose(pairs.residual, expected.residual, atol=1e-9)
    np.testing.assert_allclose(pairs.excess, expected.excess, atol=1e-9)
    np.testing.assert_allclose(pairs.direction, expected.direction, atol=1e-9)
    is_plane = (pairs.direction == case.model.normals[vertex]).all(axis=1)
    assert 0.5 < is_plane.mean() < 1.0


def test_only_the_first_pairs_are_measured() -> None:
    case = make_case()
    pairs = as_pairs(np.arange(20), np.arange(20))
    measure_pairs(case.scene, case.model, case.pose, pairs, 9)
    np.testing.assert_array_equal(np.flatnonzero(pairs.variance), np.arange(9))


def test_the_bend_brings_points_of_a_ball_nearer_to_its_surface() -> None:
    """Between vertices a plane lies off a curved surface; the residual there is the distance."""
    model = RegistrationModel(BoneModel("ball", ball_mesh(25.0, 800)))
    direction = np.random.default_rng(1).standard_normal((300, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    height = np.linspace(-0.5, 0.5, 300)
    points = direction * (25.0 + height)[:, None]
    scene = SceneArrays(points, np.zeros(300), np.zeros(3), False, False, 1)
    pairs = make_pairs(300)
    here = Pose(np.eye(3), np.zeros(3))
    n = pair_forward(scene, model.arrays, here, 1, pairs)
    measure_pairs(scene, model.arrays, here, pairs, n)
    vertex = model.arrays.points[pairs.vertex]
    plane = ((points - vertex) * model.arrays.normals[pairs.vertex]).sum(axis=1)
    of_plane, of_bend = np.abs(plane - height), np.abs(pairs.residual - height)
    assert of_bend.mean() < 0.2 * of_plane.mean()


@pytest.mark.kernel
@pytest.mark.parametrize("least_cosine", [0.2, 0.45])
@pytest.mark.parametrize("every", [1, 3])
def test_the_visible_vertices_are_counted(least_cosine: float, every: int) -> None:
    case = make_case()
    asked = reference.asked_vertices(case.scene, case.model, case.R, case.t, every, least_cosine)
    _, n_visible = pair_backward(
        case.scene, case.grid, case.model, case.pose, every, 9.0, least_cosine,
        make_pairs(N_MODEL), 0,
    )  # fmt: skip
    assert n_visible == len(asked)
    assert len(asked) > 50


def test_a_point_where_the_camera_stands_breaks_nothing() -> None:
    """Depth cameras write unknown points as zeros."""
    case = make_case()
    points = case.scene.points.copy()
    points[0] = case.scene.camera
    case.scene = case.scene._replace(points=points)
    pairs = as_pairs(np.zeros(1, dtype=int), np.zeros(1, dtype=int))
    measure_pairs(case.scene, case.model, case.pose, pairs, 1)
    assert np.isfinite(pairs.variance).all()
