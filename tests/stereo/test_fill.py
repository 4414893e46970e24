import numpy as np
import pytest

from navapp.stereo import fill_occlusions
from navapp.values import DisparityMap, Origin
from tests.reference.fill_reference import fill_slowly

NEAR, FAR = 30.0, 12.0


def as_map(disparity: np.ndarray, x: int = 0) -> DisparityMap:
    disparity = disparity.astype(np.float32)
    known = np.isfinite(disparity)
    return DisparityMap(
        disparity,
        np.where(known, 0.25, np.nan).astype(np.float32),
        np.where(known, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8),
        x,
        7,
    )


def square_scene() -> tuple[np.ndarray, np.ndarray]:
    """True disparity of a near square before a wall, and what a perfect matcher finds of it."""
    truth = np.full((60, 160), FAR)
    truth[15:45, 70:110] = NEAR
    found = truth.copy()
    columns = np.arange(160)
    found[:, columns - FAR < 0] = np.nan
    # Wall whose place in the right picture is taken by the square.
    for row in range(15, 45):
        hidden = (columns - FAR >= 70 - NEAR) & (columns - FAR < 110 - NEAR) & (truth[row] == FAR)
        found[row, hidden] = np.nan
    return truth, found


def test_both_occlusions_of_a_square_before_a_wall_get_the_wall() -> None:
    truth, found = square_scene()
    assert np.isnan(found[30, 52:70]).all()
    filled = fill_occlusions(as_map(found))
    np.testing.assert_array_equal(filled.disparity_px, truth.astype(np.float32))
    assert (filled.origin[:, :12] == Origin.FILLED_BORDER).all()
    assert (filled.origin[15:45, 52:70] == Origin.FILLED_INTERIOR).all()
    assert (filled.x, filled.y) == (0, 7)


def test_an_interior_occlusion_takes_its_left_neighbour_and_a_border_its_right_one() -> None:
    line = np.full((1, 60), np.nan)
    line[0, 12:20] = 10.0
    line[0, 30:60] = 20.0
    filled = fill_occlusions(as_map(line))
    assert (filled.disparity_px[0, :12] == 10.0).all()
    assert filled.origin[0, 5] == Origin.FILLED_BORDER
    assert (filled.disparity_px[0, 20:30] == 10.0).all()
    assert (filled.origin[0, 20:30] == Origin.FILLED_INTERIOR).all()


def test_a_gap_at_the_left_of_a_box_inside_the_picture_is_no_border() -> None:
    line = np.full((1, 40), 20.0)
    line[0, :10] = np.nan
    filled = fill_occlusions(as_map(line, x=200))
    assert (filled.origin[0, :10] == Origin.MISMATCH_FILLED).all()
    assert (filled.disparity_px[0, :10] == 20.0).all()


def test_a_mismatch_takes_the_farther_neighbour() -> None:
    line = np.full((1, 40), 14.0)
    line[0, 15:17] = np.nan
    line[0, 17:] = 13.5
    filled = fill_occlusions(as_map(line, x=100))
    assert (filled.disparity_px[0, 15:17] == 13.5).all()
    assert (filled.origin[0, 15:17] == Origin.MISMATCH_FILLED).all()


def test_matched_pixels_keep_every_bit() -> None:
    _, found = square_scene()
    before = as_map(found + np.random.default_rng(1).normal(0, 0.1, found.shape))
    after = fill_occlusions(before)
    matched = before.origin == Origin.MATCHED
    for name in ("disparity_px", "sigma_px", "origin"):
        old, new = getattr(before, name), getattr(after, name)
        assert old[matched].tobytes() == new[matched].tobytes()


def test_filled_pixels_claim_nothing() -> None:
    _, found = square_scene()
    filled = fill_occlusions(as_map(found))
    is_filled = filled.origin > Origin.MATCHED
    assert (filled.sigma_px[is_filled] >= 5.0).all()
    assert filled.matched_share == as_map(found).matched_share


def test_the_input_is_not_changed() -> None:
    _, found = square_scene()
    before = as_map(found)
    copy = before.disparity_px.copy()
    fill_occlusions(before)
    np.testing.assert_array_equal(before.disparity_px, copy)


def test_nothing_is_invented_beyond_the_largest_gap() -> None:
    line = np.full((1, 200), np.nan)
    line[0, 100] = 10.0
    filled = fill_occlusions(as_map(line, x=300), max_gap_px=15)
    known = np.flatnonzero(np.isfinite(filled.disparity_px[0]))
    assert (known.min(), known.max()) == (85, 115)
    assert (filled.origin[0, :85] == Origin.UNKNOWN).all()


def test_the_gap_counts_from_the_neighbour_that_speaks() -> None:
    """A far wall 90 px away must not reach into a gap because something near stands beside it."""
    line = np.full((1, 200), np.nan)
    line[0, :10] = 10.0
    line[0, 100:] = 10.8
    filled = fill_occlusions(as_map(line, x=300), max_gap_px=20)
    assert np.isnan(filled.disparity_px[0, 40:100]).all()
    assert (filled.origin[0, 40:100] == Origin.UNKNOWN).all()


def test_a_map_without_any_match_stays_unknown() -> None:
    filled = fill_occlusions(as_map(np.full((20, 30), np.nan)))
    assert np.isnan(filled.disparity_px).all()
    assert (filled.origin == Origin.UNKNOWN).all()


@pytest.mark.parametrize("seed", range(6))
def test_the_result_is_that_of_the_slow_reference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    disparity = np.repeat(rng.integers(5, 40, (12, 12)), 6, axis=1) + rng.normal(0, 0.3, (12, 72))
    gaps = np.repeat(rng.random((12, 12)) < 0.4, 6, axis=1) | (rng.random((12, 72)) < 0.1)
    before = as_map(np.where(gaps, np.nan, disparity), x=int(rng.integers(0, 30)))
    max_gap = int(rng.integers(2, 20))
    after = fill_occlusions(before, max_gap)
    filled, origin = fill_slowly(before, max_gap)
    np.testing.assert_array_equal(after.origin, origin)
    np.testing.assert_array_equal(after.disparity_px, filled)
