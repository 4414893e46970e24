"""Compiled parts of the classification of unmatched pixels.

Every kernel works on rows `first`, `first + step`, ... and reads of other rows only what an
earlier kernel wrote.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Of `values.Origin`, as numbers for compiled code.
_MATCHED, _BORDER, _INTERIOR, _MISMATCH = 1, 2, 3, 4

# A right pixel speaks for the left pixels this near to where it points.
_REACH_PX = 0.6
# The border strip ends where this many pixels in a row are matched.
_RUN_PX = 6
# The strip may end this far inside the right picture: its edge columns are matched badly.
_STRIP_SLACK_PX = 8.0
# The strip's end is agreed over this many rows above and below.
_STRIP_ROWS = 4
# All chosen. At a left edge the disparity grows by this much from one match to the next.
_JUMP_PX = 2.0
# A matching window hangs over an edge by up to so many pixels.
_OVERHANG_PX = 3
# So many pixels before the edge, and as many beyond the overhang, show what either side looks like.
_SAMPLE_PX = 6
# A pixel belongs behind the edge when it is more like that side by more than so many grey levels.
_LEAST_GREY_DIFFERENCE = 10


@njit(cache=True, nogil=True)
def mark_seen(
    right: NDArray[np.float32], right_offset: int, first: int, step: int, seen: NDArray[np.bool_]
) -> None:
    """Which left pixels some right pixel maps to.

    Args:
        right: (h, W) disparity of the right view, NaN where unknown.
        right_offset: column of its first pixel minus that of the left map's first pixel.
        first: row.
        step: between rows.
        seen: (h, w) in place.
    """
    height, width = seen.shape
    for y in range(first, height, step):
        seen[y] = False
        for u in range(right.shape[1]):
            d = right[y, u]
            if np.isnan(d):
                continue
            x = u + right_offset + d
            begin, end = int(np.ceil(x - _REACH_PX)), int(np.floor(x + _REACH_PX))
            for column in range(max(begin, 0), min(end, width - 1) + 1):
                seen[y, column] = True


@njit(cache=True, nogil=True)
def find_begins(
    disparity: NDArray[np.float32],
    origin: NDArray[np.uint8],
    x0: int,
    begins: NDArray[np.int64],
) -> None:
    """Column where the strip without a right partner ends, agreed with the rows around.

    Args:
        disparity: (h, w) px; read where matched.
        origin: (h, w) of the matches.
        x0: column of the map's first pixel in the rectified picture.
        begins: (h,) in place: whole column below the median of the rows' ends; 0 without a run of
            matches nearby.
    """
    height, width = disparity.shape
    ends, near = np.full(height, np.nan), np.empty(2 * _STRIP_ROWS + 1)
    for y in range(height):
        run = 0
        for x in range(width):
            run = run + 1 if origin[y, x] == _MATCHED else 0
            if run == _RUN_PX:
                end = x + 1 - _RUN_PX
                limit = disparity[y, end] + _STRIP_SLACK_PX - x0
                ends[y] = max(min(float(end), limit), 0.0)
                break
    for y in range(height):
        n = 0
        for v in range(max(y - _STRIP_ROWS, 0), min(y + _STRIP_ROWS + 1, height)):
            if not np.isnan(ends[v]):
                near[n] = ends[v]
                n += 1
        begins[y] = int(np.median(near[:n])) if n > 0 else 0


@njit(cache=True, nogil=True)
def class_rows(
    disparity: NDArray[np.float32],
    origin: NDArray[np.uint8],
    begins: NDArray[np.int64],
    seen: NDArray[np.bool_],
    picture: NDArray[np.uint8],
    first: int,
    step: int,
    classes: NDArray[np.uint8],
) -> None:
    """The class of every pixel, from what the other kernels found.

    Args:
        disparity: (h, w) px; read where matched.
        origin: (h, w) of the matches.
        begins: (h,) where the border strip ends.
        seen: (h, w) of `mark_seen`.
        picture: (h, w) grey.
        first: row.
        step: between rows.
        classes: (h, w) in place; 0 where a match stands.
    """
    height, width = classes.shape
    for y in range(first, height, step):
        row = classes[y]
        for x in range(width):
            if x < begins[y]:
                row[x] = _BORDER
            elif origin[y, x] == _MATCHED:
                row[x] = 0
            else:
                row[x] = _MISMATCH if seen[y, x] else _INTERIOR
        _withdraw_overhang(disparity[y], picture[y], row)
        _keep_possible(disparity[y], row)


@njit(cache=True, nogil=True)
def _withdraw_overhang(
    disparity: NDArray[np.float32], grey: NDArray[np.uint8], row: NDArray[np.uint8]
) -> None:
    """Matches at left edges that look like what is behind the edge become interior occlusions.

    A matching window hangs over the edge, and gives what is behind it the disparity of what is
    nearer. Nothing is withdrawn too near the map's sides, or where what is nearer is narrower than
    the overhang.
    """
    before = -1
    for x in range(len(row)):
        if row[x] != 0:
            continue
        is_edge = before >= 0 and disparity[x] - disparity[before] >= _JUMP_PX
        before, inner = x, x + _OVERHANG_PX
        if not is_edge or x < _SAMPLE_PX or inner + _SAMPLE_PX > len(row):
            continue
        if row[inner] == 0 and abs(disparity[inner] - disparity[x]) < _JUMP_PX:
            for u in range(x, inner):
                if row[u] != 0 or not _looks_like_behind(grey, x, u):
                    break
                row[u] = _INTERIOR


@njit(cache=True, nogil=True)
def _looks_like_behind(grey: NDArray[np.uint8], edge: int, u: int) -> bool:
    """Whether pixel u right of an edge is like one left of it, not like one beyond the overhang."""
    to_behind = to_nearer = 255
    for k in range(_SAMPLE_PX):
        to_behind = min(to_behind, abs(np.int64(grey[u]) - grey[edge - 1 - k]))
        to_nearer = min(to_nearer, abs(np.int64(grey[u]) - grey[edge + _OVERHANG_PX + k]))
    return bool(to_behind + _LEAST_GREY_DIFFERENCE < to_nearer)


@njit(cache=True, nogil=True)
def _keep_possible(disparity: NDArray[np.float32], row: NDArray[np.uint8]) -> None:
    """Interior occlusions left of something that is not nearer become mismatches.

    What hides an interior occlusion stands right of it, what was hidden left and farther.
    """
    x = 0
    before = -1
    while x < len(row):
        if row[x] == 0:
            before = x
            x += 1
            continue
        after = x
        while after < len(row) and row[after] != 0:
            after += 1
        is_possible = before >= 0 and (after == len(row) or disparity[before] <= disparity[after])
        if not is_possible:
            for u in range(x, after):
                row[u] = _MISMATCH if row[u] == _INTERIOR else row[u]
        x = after


@njit(cache=True, nogil=True)
def project_rows(
    left_px: NDArray[np.float32],
    left_x: int,
    first: int,
    step: int,
    right_px: NDArray[np.float32],
) -> None:
    """Carry the left view's disparities to the right columns that see them; the nearest wins.

    Args:
        left_px: (h, w), NaN where there is no surface.
        left_x: column of the first pixel.
        first: row; every `step`-th from there.
        step: of the rows.
        right_px: (h, W) in place, NaN where no surface is seen.
    """
    height, width = left_px.shape
    for y in range(first, height, step):
        right_px[y] = np.nan
        for x in range(width):
            d = left_px[y, x]
            if np.isnan(d):
                continue
            u = int(np.floor(np.float32(x + left_x) - d + np.float32(0.5)))
            if 0 <= u < right_px.shape[1] and not right_px[y, u] > d:
                right_px[y, u] = d
