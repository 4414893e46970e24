"""Classes of unmatched pixels, and what the right camera sees of a surface, pixel by pixel."""

import math

import numpy as np
from numpy.typing import NDArray

from navapp.values import Origin


def seen_from_right_reference(
    left_px: NDArray[np.float32], left_x: int, picture_width: int
) -> NDArray[np.float32]:
    """(h, W): of all left pixels that fall on a right pixel the nearest one's disparity."""
    height, width = left_px.shape
    right_px = np.full((height, picture_width), np.nan, dtype=np.float32)
    for y in range(height):
        for u in range(picture_width):
            falls_here = [
                left_px[y, x]
                for x in range(width)
                if np.isfinite(left_px[y, x])
                and math.floor(left_x + x - float(left_px[y, x]) + 0.5) == u
            ]
            if falls_here:
                right_px[y, u] = max(falls_here)
    return right_px


def classes_reference(
    disparity: NDArray[np.float32],
    is_matched: NDArray[np.bool_],
    x0: int,
    right_px: NDArray[np.float64],
    right_x0: int,
    picture: NDArray[np.uint8],
) -> NDArray[np.uint8]:
    """(h, w) 0 where a match stands, else what filled pixels will be; all inside the picture."""
    height, width = disparity.shape
    ends = [_end_of_strip(disparity[y], is_matched[y], x0) for y in range(height)]
    classes = np.zeros((height, width), dtype=np.uint8)
    for y in range(height):
        near = [end for end in ends[max(y - 4, 0) : y + 5] if end is not None]
        begin = int(np.median(near)) if near else 0
        told = np.flatnonzero(np.isfinite(right_px[y]))
        points_at = told + right_x0 + right_px[y, told] - x0
        for x in range(width):
            if x < begin:
                classes[y, x] = Origin.FILLED_BORDER
            elif not is_matched[y, x]:
                is_seen = (np.abs(points_at - x) <= 0.6).any()
                classes[y, x] = Origin.MISMATCH_FILLED if is_seen else Origin.FILLED_INTERIOR
        overhang = _find_overhang(disparity[y], classes[y] == 0, picture[y].astype(int))
        classes[y, overhang] = Origin.FILLED_INTERIOR
        for x in np.flatnonzero(classes[y] == Origin.FILLED_INTERIOR):
            stands = np.flatnonzero(classes[y] == 0)
            before, after = stands[stands < x], stands[stands > x]
            is_possible = len(before) > 0 and (
                len(after) == 0 or disparity[y, before[-1]] <= disparity[y, after[0]]
            )
            if not is_possible:
                classes[y, x] = Origin.MISMATCH_FILLED
    return classes


def _find_overhang(
    disparity: NDArray[np.float32], stands: NDArray[np.bool_], grey: NDArray[np.int64]
) -> list[int]:
    """Columns of matches at left edges that look like what is left of the edge."""
    found: list[int] = []
    before = None
    for edge in np.flatnonzero(stands):
        if edge in found:
            continue
        is_edge = before is not None and disparity[edge] - disparity[before] >= 2.0
        before = edge
        if not is_edge or edge < 6 or edge + 9 > len(stands):
            continue
        if not stands[edge + 3] or abs(disparity[edge + 3] - disparity[edge]) >= 2.0:
            continue
        sides = grey[edge - 6 : edge], grey[edge + 3 : edge + 9]
        for x in range(edge, edge + 3):
            to_behind, to_nearer = (abs(side - grey[x]).min() for side in sides)
            if not stands[x] or to_behind + 10 >= to_nearer:
                break
            found.append(x)
    return found


def _end_of_strip(disparity: NDArray, is_matched: NDArray, x0: int) -> float | None:
    """Where six matches in a row begin, hardly further than the right picture's edge."""
    for x in range(len(disparity) - 5):
        if is_matched[x : x + 6].all():
            return max(min(float(x), float(disparity[x]) + 8.0 - x0), 0.0)
    return None
