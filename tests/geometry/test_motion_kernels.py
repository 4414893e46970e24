"""Moved points and their mean displacement, beside the same in numpy."""

import numpy as np
import pytest

from navapp.geometry.motion_kernels import find_mean_motion, move_point, rotate

pytestmark = pytest.mark.kernel


def test_the_mean_motion_is_numpys() -> None:
    rng = np.random.default_rng(3)
    turned, shifted = rng.normal(size=(3, 3)), rng.normal(size=3)
    points = rng.normal(size=(41, 3))
    expected = np.linalg.norm(points @ turned.T + shifted, axis=1).mean()
    assert find_mean_motion(turned, shifted, points) == pytest.approx(expected, rel=1e-12)


def test_turned_and_moved_points_are_numpys() -> None:
    rng = np.random.default_rng(4)
    R, t, points = rng.normal(size=(3, 3)), rng.normal(size=3), rng.normal(size=(5, 3))
    for i, point in enumerate(points):
        assert rotate(R, points, i) == pytest.approx(R @ point, rel=1e-12)
        assert move_point(R, t, points, i) == pytest.approx(R @ point + t, rel=1e-12)


def test_no_points_have_no_mean() -> None:
    assert np.isnan(find_mean_motion(np.eye(3), np.ones(3), np.empty((0, 3))))
