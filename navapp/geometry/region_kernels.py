"""Compiled search for connected regions: runs of rows, joined where they touch."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def find_runs(
    values: NDArray[np.uint8], bits: int, runs: NDArray[np.int32], ends: NDArray[np.int32]
) -> int:
    """Runs of pixels that have one of some bits, row by row.

    Args:
        values: (h, w).
        bits: see above.
        runs: (N, 2) in place, first column and the one after the last; as many as fit.
        ends: (h,) in place, runs of all rows up to each.

    Returns:
        How many there are; more than fit when it is more than N.
    """
    height, width = values.shape
    n = 0
    for y in range(height):
        row = values[y]
        x = 0
        while x < width:
            if not row[x] & bits:
                x += 1
                continue
            first = x
            while x < width and row[x] & bits:
                x += 1
            if n < runs.shape[0]:
                runs[n, 0], runs[n, 1] = first, x
            n += 1
        ends[y] = n
    return n


@njit(cache=True, nogil=True)
def find_smooth_runs(
    values: NDArray[np.float32], step: np.float32, runs: NDArray[np.int32], ends: NDArray[np.int32]
) -> int:
    """As `find_runs`, of known pixels (h, w) that differ from the one before by at most a step."""
    height, width = values.shape
    n = 0
    for y in range(height):
        row = values[y]
        x = 0
        while x < width:
            if np.isnan(row[x]):
                x += 1
                continue
            first = x
            x += 1
            # Comparisons with NaN are false.
            while x < width and abs(row[x] - row[x - 1]) <= step:
                x += 1
            if n < runs.shape[0]:
                runs[n, 0], runs[n, 1] = first, x
            n += 1
        ends[y] = n
    return n


@njit(cache=True, nogil=True)
def root_of(parent: NDArray[np.int32], run: int) -> int:
    """The first run of a run's region; the way there is made shorter."""
    while parent[run] != run:
        parent[run] = parent[parent[run]]
        run = parent[run]
    return run


@njit(cache=True, nogil=True)
def join_runs(
    runs: NDArray[np.int32], ends: NDArray[np.int32], reach: int, parent: NDArray[np.int32]
) -> None:
    """Join the runs of neighbouring rows that touch.

    Args:
        runs: as `find_runs` leaves them.
        ends: the same.
        reach: 0 when only pixels above each other touch, 1 when those at a corner do as well.
        parent: (n,) in place, a run of the same region further up; itself of the first.
    """
    for i in range(parent.shape[0]):
        parent[i] = i
    for y in range(1, ends.shape[0]):
        above, last_above = ends[y - 2] if y > 1 else 0, ends[y - 1]
        for i in range(ends[y - 1], ends[y]):
            while above < last_above and runs[above, 1] + reach <= runs[i, 0]:
                above += 1
            j = above
            while j < last_above and runs[j, 0] < runs[i, 1] + reach:
                a, b = root_of(parent, i), root_of(parent, j)
                parent[max(a, b)] = min(a, b)
                j += 1


@njit(cache=True, nogil=True)
def join_smooth_runs(
    values: NDArray[np.float32],
    step: np.float32,
    runs: NDArray[np.int32],
    ends: NDArray[np.int32],
    parent: NDArray[np.int32],
) -> None:
    """As `join_runs`, where a pixel differs by at most a step from the one above it.

    Args:
        values: (h, w), NaN where unknown.
        step: see above.
        runs: as `find_smooth_runs` leaves them.
        ends: the same.
        parent: as in `join_runs`.
    """
    for i in range(parent.shape[0]):
        parent[i] = i
    for y in range(1, ends.shape[0]):
        above, last_above = ends[y - 2] if y > 1 else 0, ends[y - 1]
        for i in range(ends[y - 1], ends[y]):
            while above < last_above and runs[above, 1] <= runs[i, 0]:
                above += 1
            j = above
            while j < last_above and runs[j, 0] < runs[i, 1]:
                for x in range(max(runs[i, 0], runs[j, 0]), min(runs[i, 1], runs[j, 1])):
                    if abs(values[y, x] - values[y - 1, x]) <= step:
                        a, b = root_of(parent, i), root_of(parent, j)
                        parent[max(a, b)] = min(a, b)
                        break
                j += 1


@njit(cache=True, nogil=True)
def keep_large(
    runs: NDArray[np.int32],
    ends: NDArray[np.int32],
    parent: NDArray[np.int32],
    least: int,
    is_large: NDArray[np.bool_],
) -> int:
    """Mark the pixels of the regions of at least so many pixels; how many they are.

    Args:
        runs: as `find_runs` leaves them.
        ends: the same.
        parent: as `join_runs` leaves it.
        least: pixels.
        is_large: (h, w) in place; only set to True.
    """
    size = np.zeros(parent.shape[0], dtype=np.int64)
    for i in range(parent.shape[0]):
        size[root_of(parent, i)] += runs[i, 1] - runs[i, 0]
    total, i = 0, 0
    for y in range(ends.shape[0]):
        while i < ends[y]:
            if size[root_of(parent, i)] >= least:
                is_large[y, runs[i, 0] : runs[i, 1]] = True
                total += runs[i, 1] - runs[i, 0]
            i += 1
    return total
