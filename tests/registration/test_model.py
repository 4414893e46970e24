from dataclasses import replace

import numpy as np
import pytest

from navapp.registration import RegistrationModel
from navapp.values import BoneModel
from tests.reference.lookup_reference import nearest_by_trying_all
from tests.registration.shapes import grid_mesh


def bumpy() -> BoneModel:
    mesh = grid_mesh(lambda x, y: 3.0 * np.sin(x / 5.0) * np.cos(y / 7.0) + 0.004 * x * x, 30.0)
    return BoneModel("femur", mesh)


@pytest.fixture(scope="module")
def model() -> RegistrationModel:
    return RegistrationModel(bumpy())


def points_near(model: RegistrationModel, spread_mm: float, n: int = 800) -> np.ndarray:
    rng = np.random.default_rng(5)
    return model.points_mm[rng.integers(0, len(model.points_mm), n)] + rng.normal(
        0.0, spread_mm, (n, 3)
    )


@pytest.mark.parametrize("spread_mm", [0.3, 1.5, 4.0])
def test_the_look_up_finds_the_nearest_vertex(model: RegistrationModel, spread_mm: float) -> None:
    points = points_near(model, spread_mm)
    index, distance = model.nearest(points, 14.0)
    expected, least = nearest_by_trying_all(points, model.points_mm)
    near = least <= 14.0
    # Descent may end beside the nearest one far from the surface; never by much.
    assert (index == expected)[near].mean() > 0.99
    assert (distance - least)[near].max() < 0.3
    own = np.linalg.norm(points - model.points_mm[index], axis=1)
    np.testing.assert_allclose(distance[near], own[near], rtol=1e-12)


def test_beyond_the_radius_nothing_is_near(model: RegistrationModel) -> None:
    points = points_near(model, 3.0)
    _, least = nearest_by_trying_all(points, model.points_mm)
    _, distance = model.nearest(points, 2.0)
    assert np.isinf(distance[least > 2.0]).all()
    assert (least > 2.0).any()


def test_points_outside_the_grid_have_no_neighbour_within_its_radius(model) -> None:
    points = np.array([[500.0, 0, 0], [0, -500.0, 0], [0, 0, 900.0], [-31.0, 0.0, 0.0]])
    _, distance = model.nearest(points, 14.0)
    assert np.isinf(distance[:3]).all()
    assert np.isfinite(distance[3])


def test_a_large_radius_is_exact_everywhere(model: RegistrationModel) -> None:
    points = points_near(model, 40.0)
    index, distance = model.nearest(points, np.inf)
    _, least = nearest_by_trying_all(points, model.points_mm)
    np.testing.assert_allclose(distance, least, rtol=1e-12)
    np.testing.assert_allclose(
        np.linalg.norm(points - model.points_mm[index], axis=1), least, rtol=1e-12
    )
    _, bounded = model.nearest(points, 20.0)
    assert np.isinf(bounded[least > 20.0]).all()
    np.testing.assert_allclose(bounded[least < 20.0], least[least < 20.0], rtol=1e-12)


@pytest.mark.parametrize("radius_mm", [5.0, np.inf])
def test_no_point_is_a_valid_question(model: RegistrationModel, radius_mm: float) -> None:
    index, distance = model.nearest(np.empty((0, 3)), radius_mm)
    assert len(index) == len(distance) == 0


@pytest.mark.parametrize("radius_mm", [5.0, np.inf])
def test_parts_that_were_cut_away_pair_with_nothing(radius_mm: float) -> None:
    bone = bumpy()
    removed = bone.mesh.vertices_mm[:, 0] > 0.0
    model = RegistrationModel(replace(bone, is_removed=removed))
    _, distance = model.nearest(bone.mesh.vertices_mm, radius_mm)
    assert np.isinf(distance[removed]).all()
    np.testing.assert_allclose(distance[~removed], 0.0, atol=1e-9)


def test_cartilage_moves_the_surface_out_and_widens_its_sigma() -> None:
    bone = bumpy()
    n = len(bone.mesh.vertices_mm)
    model = RegistrationModel(
        replace(bone, cartilage_mm=np.full(n, 2.0), cartilage_sd_mm=np.full(n, 0.5))
    )
    np.testing.assert_allclose(
        model.points_mm, bone.mesh.vertices_mm + 2.0 * bone.mesh.normals, atol=1e-12
    )
    np.testing.assert_allclose(model.sigma_mm, np.hypot(0.1, 0.5))
    np.testing.assert_allclose(model.centre_mm, bone.mesh.centroid_mm)
