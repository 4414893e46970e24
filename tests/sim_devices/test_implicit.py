import numpy as np
import pytest

from sim_devices.implicit import (
    Below,
    Cone,
    Difference,
    Ellipsoid,
    Intersection,
    Roller,
    Rough,
    Scaled,
    Union,
    compute_gradient,
    make_loft,
    project,
    smooth_max,
    smooth_min,
)
from sim_devices.relief import make_waves


@pytest.fixture
def points():
    return np.random.default_rng(5).uniform(-30.0, 30.0, (400, 3))


def test_the_smooth_minimum_is_the_minimum_where_the_solids_are_apart():
    a, b = np.array([0.0, 5.0, 1.0]), np.array([4.0, 0.0, 1.0])
    np.testing.assert_allclose(smooth_min(a, b, 2.0), [0.0, 0.0, 0.5])
    np.testing.assert_allclose(smooth_max(a, b, 2.0), [4.0, 5.0, 1.5])


def test_a_ball_s_value_is_its_distance_and_its_gradient_the_radial_direction(points):
    ball = Ellipsoid((1.0, 2.0, 3.0), (10.0, 10.0, 10.0))
    relative = points - [1.0, 2.0, 3.0]
    distance = np.linalg.norm(relative, axis=1)
    np.testing.assert_allclose(ball(points), distance - 10.0, atol=1e-9)
    np.testing.assert_allclose(
        compute_gradient(ball, points), relative / distance[:, None], atol=1e-5
    )


def test_an_ellipsoid_is_finite_and_negative_at_its_centre():
    assert Ellipsoid((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))(np.array([[1.0, 2.0, 3.0]]))[0] == -4.0


def test_a_cone_is_the_least_distance_to_its_family_of_balls(points):
    start, end = np.array([0.0, 1.0, 2.0, 6.0]), np.array([5.0, -8.0, 15.0, 3.0])
    family = start + np.linspace(0.0, 1.0, 4001)[:, None] * (end - start)
    to_each = np.linalg.norm(points[:, None] - family[None, :, :3], axis=2) - family[None, :, 3]
    value = Cone(tuple(start), tuple(end))(points)
    np.testing.assert_allclose(value, to_each.min(axis=1), atol=1e-4)


def test_a_loft_with_equal_radii_is_a_cylinder(points):
    rows = [[z, 2.0, -1.0, 7.0, 7.0, 7.0, 7.0] for z in (-40.0, 0.0, 40.0)]
    radius = np.hypot(points[:, 0] - 2.0, points[:, 1] + 1.0)
    np.testing.assert_allclose(make_loft(rows, 2.0)(points), radius - 7.0, atol=1e-6)


def test_a_twisted_loft_turns_with_height():
    rows = [[z, 0.0, 0.0, 10.0, 10.0, 5.0, 5.0] for z in (-50.0, 50.0)]
    quarter = make_loft(rows, 2.0, twist_rad_per_mm=np.pi / 2.0 / 40.0)
    np.testing.assert_allclose(
        quarter(np.array([[10.0, 0.0, 0.0], [0.0, 10.0, 40.0]])), 0.0, atol=1e-6
    )


def test_a_roller_reaches_as_far_as_its_discs_and_its_width():
    roller = Roller(np.array([[0.0, 0.0, 20.0], [10.0, 0.0, 20.0]]), 5.0, 0.0, 12.0, 4.0, 0.0)
    on_surface = np.array([[5.0, -20.0, 0.0], [5.0, 30.0, 0.0], [17.0, 5.0, 0.0]])
    np.testing.assert_allclose(roller(on_surface), 0.0, atol=1e-9)


def test_a_height_limit_is_a_distance_on_a_slope():
    slope = Below(lambda p: p[:, 0], axis=2)
    assert slope(np.array([[0.0, 0.0, 2.0]]))[0] == pytest.approx(np.sqrt(2.0))
    above = Below(lambda p: p[:, 0], axis=2, upwards=False)
    assert above(np.array([[0.0, 0.0, 2.0]]))[0] == pytest.approx(-np.sqrt(2.0))


def test_union_intersection_and_difference_combine_the_insides(points):
    a, b = Ellipsoid((-6.0, 0, 0), (15.0, 15.0, 15.0)), Ellipsoid((6.0, 0, 0), (15.0, 15.0, 15.0))
    in_a, in_b = a(points) < -0.1, b(points) < -0.1
    clear = (np.abs(a(points)) > 0.1) & (np.abs(b(points)) > 0.1)
    for solid, expected in (
        (Union(a, ((b, 0.1),)), in_a | in_b),
        (Intersection(a, b, 0.1), in_a & in_b),
        (Difference(a, b, 0.1), in_a & ~in_b),
    ):
        np.testing.assert_array_equal(solid(points)[clear] < 0.0, expected[clear])


def test_a_negative_scale_mirrors(points):
    solid = Ellipsoid((6.0, 1.0, 2.0), (5.0, 7.0, 9.0))
    mirror = np.array([-1.0, 1.0, 1.0])
    mirrored = Scaled(solid, mirror, np.zeros(3))
    np.testing.assert_allclose(mirrored(points * mirror), solid(points))


def test_relief_has_the_asked_for_height_and_moves_the_surface_outwards():
    points = np.random.default_rng(6).uniform(-200.0, 200.0, (20000, 3))
    relief = make_waves(np.random.default_rng(7), 0.3, (6.0, 25.0))
    assert relief(points).std() == pytest.approx(0.3, rel=0.1)
    flat = Below(lambda p: np.zeros(len(p)), axis=2)
    rough = Rough(flat, relief)
    on_surface = project(rough, points * [1.0, 1.0, 0.0])
    np.testing.assert_allclose(on_surface[:, 2], relief(on_surface), atol=1e-3)


def test_projection_ends_on_the_surface():
    solid = Ellipsoid((0.0, 0.0, 0.0), (20.0, 12.0, 8.0))
    directions = np.random.default_rng(8).standard_normal((100, 3))
    start = 15.0 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    assert np.abs(solid(project(solid, start, iterations=12))).max() < 1e-6
