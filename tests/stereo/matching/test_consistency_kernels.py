"""Compiled comparison of the views against whole arrays."""

import numpy as np
import pytest

from navapp.stereo.matching.consistency_kernels import (
    Demands,
    Evidence,
    judge_rows,
    partner_values,
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


@pytest.mark.kernel
@pytest.mark.parametrize("shift", [-6, 0, 3])
def test_partners_are_found_as_the_definition_says(shift) -> None:
    seen = evidence(shift)
    found = np.empty_like(seen.left_px)
    partner_values(seen.right_px, seen.left_px, shift, np.float32(-9.0), found)
    expected = reference.at_partner(seen.right_px, seen.left_px, shift, -9.0)
    assert np.array_equal(found, expected, equal_nan=True)
