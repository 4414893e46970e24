"""Occlusion filling, pixel by pixel."""

import math

import numpy as np
from numpy.typing import NDArray

from navapp.values import DisparityMap, Origin


def fill_slowly(disparity_map: DisparityMap, max_gap_px: int) -> tuple[NDArray, NDArray]:
    """Disparity and origin after filling, by the rules in words and loops."""
    disparity = disparity_map.disparity_px
    filled, origin = disparity.copy(), disparity_map.origin.copy()
    for row in range(disparity.shape[0]):
        line = disparity[row]
        known = [c for c in range(len(line)) if math.isfinite(line[c])]
        for column in range(len(line)):
            if column in known:
                continue
            left = max((c for c in known if c < column), default=None)
            right = min((c for c in known if c > column), default=None)
            neighbour, label = _choice(line, known, column, left, right, disparity_map.x)
            if neighbour is not None and abs(neighbour - column) <= max_gap_px:
                filled[row, column] = line[neighbour]
                origin[row, column] = label
    return filled, origin


def _choice(
    line: NDArray, known: list[int], column: int, left: int | None, right: int | None, x: int
) -> tuple[int | None, Origin]:
    """Which neighbour may speak for a pixel, and what that makes of the pixel."""
    if left is None and right is None:
        return None, Origin.UNKNOWN
    if left is None:
        is_border = x + column - line[right] < 0
        return right, Origin.FILLED_BORDER if is_border else Origin.MISMATCH_FILLED
    if _hides(line, known, column, line[left]):
        return left, Origin.FILLED_INTERIOR
    if right is None or line[left] <= line[right]:
        return left, Origin.MISMATCH_FILLED
    return right, Origin.MISMATCH_FILLED


def _hides(line: NDArray, known: list[int], column: int, assumed: float) -> bool:
    """Something more than a pixel nearer sits where the right camera would see this pixel."""
    partner = math.floor(column - assumed + np.float32(0.5))
    return any(
        math.floor(c - line[c] + np.float32(0.5)) == partner and line[c] > assumed + 1.0
        for c in known
    )
