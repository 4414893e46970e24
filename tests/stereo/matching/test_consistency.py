"""Left-right check."""

import numpy as np
import pytest

from navapp.stereo.matching.consistency import (
    at_partner,
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
