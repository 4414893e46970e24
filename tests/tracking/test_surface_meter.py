"""The measured surface on the model: which of it the fit may trust."""

import numpy as np
import pytest

from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, remove_gap_rims
from navapp.values import DisparityMap
from tests.tracking.rooms import room

SHAPE = (80, 120)
EVERYWHERE = np.ones(SHAPE, dtype=bool)


def found_beside(gap: np.ndarray) -> DisparityMap:
    known = ~gap
    disparity = np.where(known, 40.0, np.nan).astype(np.float32)
    sigma = np.where(known, 0.1, np.nan).astype(np.float32)
    return DisparityMap(disparity, sigma, known.astype(np.uint8), 5, 7)


def gap_of(height: int, width: int) -> np.ndarray:
    gap = np.zeros(SHAPE, dtype=bool)
    gap[30 : 30 + height, 40 : 40 + width] = True
    return gap


def test_the_rim_of_a_large_gap_is_not_trusted() -> None:
    found = found_beside(gap_of(25, 30))
    trusted = remove_gap_rims(found, EVERYWHERE)
    expected = np.ones(SHAPE, dtype=bool)
    expected[27:58, 37:73] = False
    np.testing.assert_array_equal(trusted.origin > 0, expected)
    np.testing.assert_array_equal(np.isfinite(trusted.disparity_px), expected)
    np.testing.assert_array_equal(np.isfinite(trusted.sigma_px), expected)
    assert (trusted.x, trusted.y) == (found.x, found.y)


def test_around_a_small_gap_everything_is_trusted() -> None:
    found = found_beside(gap_of(15, 20))
    np.testing.assert_array_equal(remove_gap_rims(found, EVERYWHERE).origin, found.origin)


def test_beside_the_model_is_no_gap() -> None:
    gap = gap_of(25, 30)
    found = found_beside(gap)
    np.testing.assert_array_equal(remove_gap_rims(found, ~gap).origin, found.origin)


def test_where_too_little_would_be_left_all_of_it_is_trusted() -> None:
    stripes = np.zeros(SHAPE, dtype=bool)
    stripes[:, 3:] = np.arange(3, SHAPE[1]) % 8 > 0
    found = found_beside(stripes)
    np.testing.assert_array_equal(remove_gap_rims(found, EVERYWHERE).origin, found.origin)


def test_relief_goes_together_over_four_millimetres() -> None:
    a = room()
    picture, meter = a.frames[0], a.tracker.meter
    pose = a.tracker.rectify_pose(a.truth(picture))
    expected = meter.render(
        meter.rectify(picture.left, picture.right, pose, NEAR_VIEW), pose, NEAR_BOX
    )
    assert expected is not None
    measured = meter.measure_on_model(expected)
    depth_mm = np.median(measured.cloud.points_mm[:, 2])
    expected_px = 4.0 * meter.geometry.focal_px / depth_mm
    assert measured.relief_px == pytest.approx(expected_px, rel=0.01)
