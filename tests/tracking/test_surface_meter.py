"""The measured surface on the model: which of it the fit may trust."""

import numpy as np

from navapp.tracking.surface_meter import doubt_gap_rims
from navapp.values import DisparityMap

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


def doubted(found: DisparityMap, is_expected: np.ndarray = EVERYWHERE) -> np.ndarray:
    """Where it is trusted less than it claims; nothing else changes."""
    trusted = doubt_gap_rims(found, is_expected)
    np.testing.assert_array_equal(trusted.disparity_px, found.disparity_px)
    np.testing.assert_array_equal(trusted.origin, found.origin)
    assert (trusted.x, trusted.y) == (found.x, found.y)
    ratio = trusted.sigma_px / found.sigma_px
    assert set(np.unique(ratio[found.origin > 0])) <= {np.float32(1.0), np.float32(4.0)}
    return ratio > 1.0


def test_the_rim_of_a_large_gap_is_trusted_less() -> None:
    gap = gap_of(25, 30)
    expected = np.zeros(SHAPE, dtype=bool)
    expected[27:58, 37:73] = True
    np.testing.assert_array_equal(doubted(found_beside(gap)), expected & ~gap)


def test_around_a_small_gap_everything_is_trusted() -> None:
    assert not doubted(found_beside(gap_of(15, 20))).any()


def test_beside_the_model_is_no_gap() -> None:
    gap = gap_of(25, 30)
    assert not doubted(found_beside(gap), ~gap).any()
