import numpy as np
import pytest

from navapp.preop.extreme_points import SURFACE_NOISE_MM, find_extreme
from tests.geometry.shapes import sphere

UP = np.array([0.0, 0.0, 1.0])


def everywhere(points: np.ndarray) -> np.ndarray:
    return np.ones(len(points), dtype=bool)


def nowhere(points: np.ndarray) -> np.ndarray:
    return np.zeros(len(points), dtype=bool)


@pytest.mark.parametrize("radius_mm", [10.0, 20.0, 40.0])
def test_the_deviation_follows_from_the_flatness(radius_mm) -> None:
    """Within e of the top of a ball lies a cap of radius sqrt(2 R e); its rms is 0.7 of that."""
    points = sphere(radius_mm, 150).vertices_mm
    points = points[np.abs(points[:, 2]) < 0.9999 * radius_mm]  # the pole is denser than the rest
    found = find_extreme(points, nowhere(points), everywhere(points), UP)
    expected = np.hypot(np.sqrt(radius_mm * SURFACE_NOISE_MM), SURFACE_NOISE_MM)
    assert found.sd_mm == pytest.approx(expected, rel=0.35)
    assert np.linalg.norm(found.point_mm - radius_mm * UP) < expected


def test_the_surface_noise_is_the_least_that_is_told() -> None:
    spike = np.array([[0.0, 0.0, 5.0], [1.0, 0.0, 0.0]])
    assert find_extreme(spike, nowhere(spike), everywhere(spike), UP).sd_mm == pytest.approx(
        SURFACE_NOISE_MM
    )


def test_a_plain_and_two_summits_have_no_extreme_point() -> None:
    x, y = np.meshgrid(np.linspace(-20, 20, 21), np.linspace(-20, 20, 21))
    plain = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    assert find_extreme(plain, nowhere(plain), everywhere(plain), UP) is None
    summits = np.array([[-15.0, 0, 10], [15.0, 0, 10.1], [0, 0, 0]])
    assert find_extreme(summits, nowhere(summits), everywhere(summits), UP) is None


def test_nothing_among_has_none() -> None:
    points = np.zeros((3, 3))
    assert find_extreme(points, nowhere(points), nowhere(points), UP) is None


def test_what_is_outermost_where_the_surface_was_cut_is_no_extreme_point() -> None:
    points = sphere(20.0, 60).vertices_mm
    points = points[points[:, 2] < 15.0]
    is_border = points[:, 2] > 14.0
    assert find_extreme(points, is_border, everywhere(points), UP) is None
    below = find_extreme(points, is_border, everywhere(points), -UP)
    assert np.linalg.norm(below.point_mm + 20.0 * UP) < 3.0
