"""Compiled comparison of the two views."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Evidence(NamedTuple):
    """What both views say."""

    left_px: NDArray[np.float32]  # (h, w) disparity, NaN unknown
    right_px: NDArray[np.float32]  # (h, W) disparity, NaN unknown
    uniqueness: NDArray[np.float32]  # (h, w) of the left disparity, 0 to 1
    left_contrast: NDArray[np.uint8]  # (h, w) range of grey levels around a pixel
    right_contrast: NDArray[np.uint8]  # (h, W)
    shift: int  # right column of the left column 0 at disparity 0


class Demands(NamedTuple):
    """What a match must reach; see `CensusSettings`."""

    contrast_grey: int
    full_contrast_grey: np.float32
    max_difference_px: np.float32
    min_uniqueness: np.float32


@njit(cache=True, nogil=True)
def partner_column(x: int, shift: int, disparity_px: np.float32, right_width: int) -> int:
    """Nearest whole column in the right view, the right one of two; -1 where there is none."""
    position = np.floor(x + (shift + 0.5) - np.float64(disparity_px))
    return int(position) if 0.0 <= position <= right_width - 1 else -1


@njit(cache=True, nogil=True)
def judge_rows(
    evidence: Evidence,
    demands: Demands,
    rows: tuple[int, int],
    is_judged: NDArray[np.bool_],
    confidence: NDArray[np.float32],
) -> None:
    """Which left pixels have contrast, which are matched, how surely.

    Args:
        evidence: of both views; `left_px` becomes NaN where unmatched.
        demands: on a match.
        rows: first, and after the last, to fill.
        is_judged: (h, w) in place: both windows have contrast.
        confidence: (h, w) in place: uniqueness * texture * agreement, 0 where unmatched.
    """
    left_px, right_px, uniqueness, left_contrast, right_contrast, shift = evidence
    contrast_grey, full_contrast, max_difference, min_uniqueness = demands
    one, half = np.float32(1.0), np.float32(0.5)
    for y in range(rows[0], rows[1]):
        for x in range(left_px.shape[1]):
            u = partner_column(x, shift, left_px[y, x], right_px.shape[1])
            contrast = min(left_contrast[y, x], right_contrast[y, u]) if u >= 0 else np.uint8(0)
            difference = abs(right_px[y, u] - left_px[y, x]) if u >= 0 else np.float32(np.nan)
            is_judged[y, x] = contrast >= contrast_grey
            if (
                is_judged[y, x]
                and difference <= max_difference
                and uniqueness[y, x] >= min_uniqueness
            ):
                texture = min(np.float32(contrast) / full_contrast, one)
                # Views that differ by all that is allowed keep half of the confidence.
                closeness = one - half * difference / max_difference
                confidence[y, x] = uniqueness[y, x] * texture * closeness
            else:
                left_px[y, x] = np.nan
                confidence[y, x] = 0.0
