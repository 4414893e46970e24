"""Compiled parts of the classification of unmatched pixels."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# A right pixel speaks for the left pixels this near to where it points.
_REACH_PX = 0.6
# The border strip ends where this many pixels in a row are matched.
_RUN_PX = 6
# The strip may end this far inside the right picture: its edge columns are matched badly.
_STRIP_SLACK_PX = 8.0

# Left edges of near objects: the smallest jump, how many pixels right of it may belong to the
# background, and how many on either side show what background and object look like.
_JUMP_PX = 2.0
_ZONE_PX = 3
_SAMPLE_PX = 6
_MIN_SAMPLES = 3
# Colours differ enough at this sum of three channels; moving the edge costs this per pixel.
_LARGEST_COLOUR = 90
_STAY = 20


@njit(cache=True, nogil=True)
def mark_seen(
    right: NDArray[np.float32], right_offset: int, first: int, last: int, seen: NDArray[np.bool_]
) -> None:
    """Mark the left pixels that some right pixel maps to, in rows `first` to `last` (exclusive).

    Args:
        right: (h, W) disparity of the right view, NaN where unknown.
        right_offset: column of its first pixel minus that of the left map's first pixel.
        first: row.
        last: row after the last.
        seen: (h, w) in place; False before.
    """
    width = seen.shape[1]
    for y in range(first, last):
        for u in range(right.shape[1]):
            d = right[y, u]
            if np.isnan(d):
                continue
            x = u + right_offset + d
            begin, end = int(np.ceil(x - _REACH_PX)), int(np.floor(x + _REACH_PX))
            for column in range(max(begin, 0), min(end, width - 1) + 1):
                seen[y, column] = True


@njit(cache=True, nogil=True)
def strip_ends(
    disparity: NDArray[np.float32], matched: NDArray[np.bool_], x0: int, ends: NDArray[np.float64]
) -> None:
    """Column where the strip without a right partner ends; NaN in rows without a run of matches.

    Args:
        disparity: (h, w) px; read where matched.
        matched: (h, w).
        x0: column of the map's first pixel in the rectified picture.
        ends: (h,) in place.
    """
    height, width = disparity.shape
    for y in range(height):
        ends[y] = np.nan
        run = 0
        for x in range(width):
            run = run + 1 if matched[y, x] else 0
            if run == _RUN_PX:
                end = x + 1 - _RUN_PX
                limit = disparity[y, end] + _STRIP_SLACK_PX - x0
                ends[y] = max(min(float(end), limit), 0.0)
                break


@njit(cache=True, nogil=True)
def edge_splits(
    disparity: NDArray[np.float32],
    matched: NDArray[np.bool_],
    picture: NDArray[np.int16],
    first: int,
    last: int,
    splits: NDArray[np.int8],
) -> None:
    """How many pixels right of each jump to something nearer look like the background.

    Args:
        disparity: (h, w) px; read where matched.
        matched: (h, w).
        picture: (h, w, 3).
        first: row.
        last: row after the last (exclusive).
        splits: (h, w) in place at the first pixel right of a jump; -1 elsewhere, set before.
    """
    width = disparity.shape[1]
    samples = np.empty(_SAMPLE_PX, np.int64)
    for y in range(first, last):
        previous = -1
        for x in range(width):
            if not matched[y, x]:
                continue
            is_jump = previous >= 0 and disparity[y, x] - disparity[y, previous] >= _JUMP_PX
            previous = x
            if not is_jump or x < _MIN_SAMPLES:
                continue
            n = 0
            for u in range(x + _ZONE_PX, min(x + _ZONE_PX + _SAMPLE_PX, width)):
                if matched[y, u] and abs(disparity[y, u] - disparity[y, x]) < _JUMP_PX:
                    samples[n] = u
                    n += 1
            if n >= _MIN_SAMPLES:
                splits[y, x] = _best_split(picture[y], x, samples[:n])


@njit(cache=True, nogil=True)
def _best_split(row: NDArray[np.int16], x: int, samples: NDArray[np.int64]) -> int:
    """Number of pixels from x on that resemble what is left of x more than the samples."""
    best, best_cost, cost = 0, 0, 0
    for k in range(_ZONE_PX):
        to_object = to_background = _LARGEST_COLOUR
        for i in range(len(samples)):
            to_object = min(to_object, _difference(row, x + k, samples[i]))
        for u in range(max(x - _SAMPLE_PX, 0), x):
            to_background = min(to_background, _difference(row, x + k, u))
        cost += to_background - to_object + _STAY
        if cost < best_cost:
            best, best_cost = k + 1, cost
    return best


@njit(cache=True, nogil=True)
def _difference(row: NDArray[np.int16], u: int, v: int) -> int:
    """Sum of the three absolute colour differences."""
    return (
        abs(int(row[u, 0]) - int(row[v, 0]))
        + abs(int(row[u, 1]) - int(row[v, 1]))
        + abs(int(row[u, 2]) - int(row[v, 2]))
    )


@njit(cache=True, nogil=True)
def withdraw(splits: NDArray[np.int8], withdrawn: NDArray[np.bool_]) -> None:
    """Mark the pixels left of the agreed edge.

    An edge moves by the median of the splits beside it (two columns, two rows to every side): one
    row alone is moved by noise.
    """
    height, width = splits.shape
    near = np.empty(25, np.int64)
    for y in range(height):
        for x in range(width):
            if splits[y, x] < 0:
                continue
            n = 0
            for v in range(max(y - 2, 0), min(y + 3, height)):
                for u in range(max(x - 2, 0), min(x + 3, width)):
                    if splits[v, u] >= 0:
                        near[n] = splits[v, u]
                        n += 1
            agreed = int(np.median(near[:n])) if n > 1 else 0
            for u in range(x, min(x + agreed, width)):
                withdrawn[y, u] = True
