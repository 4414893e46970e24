"""Compiled comparison of the views against whole arrays."""

import numpy as np
import pytest

from navapp.stereo.matching.consistency_kernels import (
    Demands,
    Evidence,
    judge_rows,
    partner_column,
)
from tests.reference import consistency_reference as reference

HEIGHT, WIDTH, RIGHT_WIDTH = 7, 30, 26


def evidence(shift: int) -> Evidence:
    rng = np.random.default_rng(3)
    truth = rng.integers(2, 9, (HEIGHT, 1))
    left_px = (truth + rng.choice([-0.5, 0.0, 0.2, 0.5, np.nan], (HEIGHT, WIDTH))).astype("f4")
    right_px = (truth + rng.choice([-1, 0, 0, 1, np.nan], (HEIGHT, RIGHT_WIDTH))).astype("f4")
    return Evidence(
        left_px,
        right_px,
        rng.random((HEIGHT, WIDTH), dtype=np.float32),
        rng.integers(0, 24, (HEIGHT, WIDTH), dtype=np.uint8),
        rng.integers(0, 24, (HEIGHT, RIGHT_WIDTH), dtype=np.uint8),
        shift,
    )


@pytest.mark.kernel
@pytest.mark.parametrize("shift", [-6, 0, 3, 40])
@pytest.mark.parametrize("least_contrast", [0, 3])
def test_matches_are_judged_as_the_definition_says(shift, least_contrast) -> None:
    seen = evidence(shift)
    demands = Demands(least_contrast, np.float32(16.0), np.float32(1.0), np.float32(0.05))
    expected_judged, expected_matched, expected = reference.judge(seen, demands)
    given = seen.left_px.copy()
    is_judged, confidence = np.empty(given.shape, dtype=np.bool_), np.empty_like(given)
    for rows in ((0, 3), (3, HEIGHT)):
        judge_rows(seen, demands, rows, is_judged, confidence)
    assert np.array_equal(is_judged, expected_judged)
    kept = np.where(expected_matched, given, np.float32(np.nan))
    assert np.array_equal(seen.left_px, kept, equal_nan=True)
    np.testing.assert_allclose(confidence, expected, rtol=1e-6)
    assert expected_matched.any() == (shift < 40)


@pytest.mark.parametrize(
    ("disparity", "column"),
    [(2.0, 3), (2.4, 3), (2.5, 3), (2.51, 2), (1.51, 3), (1.5, 4), (5.6, -1), (np.nan, -1)],
)
def test_the_partner_is_the_nearest_whole_column_and_the_right_one_of_two(
    disparity, column
) -> None:
    assert partner_column(5, 0, np.float32(disparity), 10) == column


def test_a_shift_moves_the_partner_and_outside_is_none() -> None:
    one = np.float32(1.0)
    assert [partner_column(x, 3, one, 4) for x in range(4)] == [2, 3, -1, -1]
    assert [partner_column(x, -1, one, 4) for x in range(4)] == [-1, -1, 0, 1]
    assert partner_column(1, 0, one, 0) == -1
