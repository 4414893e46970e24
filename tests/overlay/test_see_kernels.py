"""Compiled look-up of the measured depth, beside a plain loop."""

import numpy as np
import pytest

from navapp.overlay.see_kernels import Measured, look_up_depth
from navapp.values import Origin

SHAPE, WHOLE, FIRST = (12, 15), (14, 20), (3, 1)


def map_of(seed: int, shape: tuple[int, int], x: int, y: int, halvings: int) -> Measured:
    rng = np.random.default_rng(seed)
    disparity = rng.uniform(20.0, 90.0, shape).astype(np.float32)
    disparity[rng.random(shape) < 0.2] = np.nan
    is_matched = (rng.random(shape) < 0.5) & np.isfinite(disparity)
    origin = np.where(is_matched, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8)
    return Measured(disparity, origin, x, y, halvings)


def plain(u: int, v: int, given: Measured) -> tuple[float, bool]:
    x, y = u // 2**given.halvings - given.x, v // 2**given.halvings - given.y
    height, width = given.disparity.shape
    if not (0 <= x < width and 0 <= y < height):
        return np.nan, False
    is_matched = given.origin[y, x] == Origin.MATCHED
    return 2**given.halvings * float(given.disparity[y, x]), bool(is_matched)


@pytest.mark.kernel
@pytest.mark.parametrize("halvings", [0, 1])
def test_what_is_matched_finer_holds_and_beside_the_marks_nothing_is_known(halvings: int) -> None:
    rng = np.random.default_rng(3)
    around = map_of(1, (10, 11), 10 >> halvings, 4 >> halvings, halvings)
    finer = map_of(2, (6, 5), 13, 6, 0)
    marks = rng.random((10, 11)) < 0.3
    columns = rng.integers(-1, 25, WHOLE).astype(np.int16)
    rows = rng.integers(-1, 18, WHOLE).astype(np.int16)
    depth_share = rng.uniform(0.9, 1.1, WHOLE).astype(np.float32)
    depth_mm = np.empty(SHAPE, np.float32)
    is_guess, in_front = np.empty((2, *SHAPE), np.uint8)
    look_up_depth(
        columns, rows, depth_share, FIRST, 5e4, around, finer, marks, (10, 4), depth_mm, is_guess,
        in_front,
    )  # fmt: skip
    kinds = set()
    for j, i in np.ndindex(SHAPE):
        at = j + FIRST[1], i + FIRST[0]
        u, v = int(columns[at]), int(rows[at])
        expected, guess, front = np.nan, 1, 0
        if 10 <= u < 21 and 4 <= v < 14:
            front = 255 * marks[v - 4, u - 10]
            disparity, matched = plain(u, v, finer)
            if not matched:
                disparity, matched = plain(u, v, around)
            guess, expected = 1 - matched, 5e4 / disparity * depth_share[at]
        kinds.add((guess, front, bool(np.isnan(expected))))
        assert (is_guess[j, i], in_front[j, i]) == (guess, front)
        np.testing.assert_allclose(depth_mm[j, i], expected, rtol=1e-5)
    assert len(kinds) >= 5
