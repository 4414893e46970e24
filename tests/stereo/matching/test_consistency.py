"""Left-right check, speckles, share of agreement."""

import math

import numpy as np
import pytest

from navapp.stereo.matching.consistency import (
    agreement_share,
    at_partner,
    speckle_free,
    view_difference_px,
)

NAN = np.float32(np.nan)


def row(*values: float) -> np.ndarray:
    return np.array([values], dtype=np.float32)


@pytest.mark.parametrize(
    ("disparity", "column"), [(2.0, 3), (2.4, 3), (2.5, 3), (2.51, 2), (1.51, 3), (1.5, 4)]
)
def test_the_partner_is_the_nearest_whole_column_and_the_right_one_of_two(
    disparity, column
) -> None:
    right = np.arange(10, dtype=np.int32)[None]
    left = np.full((1, 6), np.nan, dtype=np.float32)
    left[0, 5] = disparity
    assert at_partner(right, left, 0, np.int32(-1))[0].tolist() == [-1] * 5 + [column]


def test_a_shift_moves_the_partner_and_outside_is_missing() -> None:
    right = np.arange(4, dtype=np.int32)[None]
    assert at_partner(right, row(1, 1, 1, 1), 3, np.int32(-1))[0].tolist() == [2, 3, -1, -1]
    assert at_partner(right, row(1, 1, 1, 1), -1, np.int32(-1))[0].tolist() == [-1, -1, 0, 1]
    none = np.empty((1, 0), dtype=np.int32)
    assert at_partner(none, row(1, 1), 0, np.int32(-1))[0].tolist() == [-1, -1]


def test_the_difference_of_the_views_is_unknown_where_either_is() -> None:
    left = row(NAN, 1.0, 1.4, 1.0, 9.0)
    right = row(1.0, 3.0, NAN, 1.0, 1.0)
    found = view_difference_px(left, right, 0)[0]
    # Partners: none, 0, 1, 2 (unknown), outside.
    assert found[1] == 0.0
    assert found[2] == pytest.approx(1.6)
    assert np.isnan(found[[0, 3, 4]]).all()


@pytest.mark.parametrize("base", [0.0, 900.0, -300.5])
def test_small_patches_go_and_large_ones_stay(base) -> None:
    disparity = np.full((12, 20), np.nan, dtype=np.float32)
    disparity[1:5, 1:5] = base + 10.0  # 16 pixels
    disparity[7:10, 1:6] = base + 10.0  # 15 pixels
    disparity[1:9, 10:18] = base + 20.0 + 0.9 * np.arange(8)  # slanted, connected
    kept = speckle_free(disparity, 16, 1.0)
    assert kept[1:5, 1:5].all()
    assert not kept[7:10].any(where=np.arange(20) < 8)
    assert kept[1:9, 10:18].all()
    assert kept.sum() == 16 + 64


def test_patches_are_parted_where_the_disparity_jumps() -> None:
    disparity = np.full((4, 8), 5.0, dtype=np.float32)
    disparity[:, 3:] = 6.5
    kept = speckle_free(disparity, 20, 1.0)
    assert not kept[:, :3].any()
    assert kept[:, 3:].all()


def test_whole_steps_of_single_precision_connect_and_larger_ones_part() -> None:
    # Across a power of two, the last digits of two neighbours weigh differently.
    whole = (1020.0 + 8.54e-5 + np.arange(8.0)).astype(np.float32)[None]
    assert np.abs(np.diff(whole)).max() > 1.0
    assert speckle_free(whole, 8, 1.0).all()
    assert not speckle_free((1.01 * np.arange(8.0)).astype(np.float32)[None], 2, 1.0).any()


def test_nothing_known_stays_nothing() -> None:
    assert not speckle_free(np.full((3, 3), np.nan, dtype=np.float32), 2, 1.0).any()


def test_the_share_counts_judged_pixels_only() -> None:
    agrees = np.array([True, True, False, False])
    assert agreement_share(agrees, np.array([True, False, True, False])) == 0.5
    assert math.isnan(agreement_share(agrees, np.zeros(4, dtype=bool)))
