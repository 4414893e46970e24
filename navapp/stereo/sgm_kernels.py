"""Compiled semi-global aggregation of census distances, and the choice of both views' disparities.

Path costs stay below 64 + p2, so sums of four paths fit into int16.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Beyond both ends of the disparities: never the best predecessor.
_FAR = np.int16(20000)
_START = 2
_MOST_16 = np.int16(32767)
_MOST_32 = np.int32(2147483647)
_NUMBER_BITS = np.int32(10)
_NUMBER_MASK = np.int32(1023)


@njit(cache=True, nogil=True)
def popcount(bits: np.uint64) -> np.int16:
    """Number of ones."""
    bits = bits - ((bits >> np.uint64(1)) & np.uint64(0x5555555555555555))
    fours = np.uint64(0x3333333333333333)
    bits = (bits & fours) + ((bits >> np.uint64(2)) & fours)
    bits = (bits + (bits >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int16((bits * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(cache=True, nogil=True)
def extend_path(
    paths: NDArray[np.int16],
    lowest: NDArray[np.int16],
    place: tuple[int, int, int, int],
    cost: NDArray[np.int16],
    penalties: tuple[np.int16, np.int16],
    pixel: tuple[int, int],
    total: NDArray[np.int16],
) -> None:
    """One step of one path.

    Args:
        paths: (3, w, 4, n + 2) path costs, in place; one place beyond either end.
        lowest: (3, w, 4) their minima, in place.
        place: path; row and column before in `paths`; row here.
        cost: (n,) matching cost here.
        penalties: of a step of one disparity, of any other step.
        pixel: y, x.
        total: (h, w, n) in place, the path is added.

    Source: Hirschmueller 2008, equation (13). Whole arrays and indices come in because a view per
    step would cost as much as the step.
    """
    j, then, xb, now = place
    y, x = pixel
    p1, jump = penalties
    subtracted = lowest[then, xb, j]
    highest = np.int16(subtracted + jump)
    lowest_here = _MOST_16
    for k in range(cost.shape[0]):
        near = min(np.int16(paths[then, xb, j, k] + p1), np.int16(paths[then, xb, j, k + 2] + p1))
        value = min(min(paths[then, xb, j, k + 1], near), highest)
        value = np.int16(value - subtracted + cost[k])
        paths[now, x, j, k + 1] = value
        lowest_here = min(lowest_here, value)
        total[y, x, k] += value
    lowest[now, x, j] = lowest_here


@njit(cache=True, nogil=True)
def jump_penalty(p1: np.int16, p2: np.int16, edge_grey: int, step_grey: int) -> np.int16:
    """Penalty of a jump of the disparity: smaller across an edge, always above p1."""
    return np.int16(max(p1 + 1, p2 // (1 + abs(step_grey) // edge_grey)))


@njit(cache=True, nogil=True)
def census_cost(
    code: np.uint64,
    right: NDArray[np.uint64],
    y: int,
    first_partner: int,
    no_partner: np.int16,
    cost: NDArray[np.int16],
) -> None:
    """(n,) Hamming distances to the columns first_partner, first_partner - 1, ... of row y."""
    for k in range(cost.shape[0]):
        u = first_partner - k
        if 0 <= u < right.shape[1]:
            cost[k] = popcount(code ^ right[y, u])
        else:
            cost[k] = no_partner


@njit(cache=True, nogil=True)
def aggregate_scan(
    left: NDArray[np.uint64],
    right: NDArray[np.uint64],
    grey: NDArray[np.uint8],
    first_partner: int,
    penalties: tuple[np.int16, np.int16, np.int16, int],
    is_backward: bool,
    total: NDArray[np.int16],
) -> None:
    """Four of the eight paths: those that one scan over the picture can follow.

    Args:
        left: (h, w) census codes.
        right: (h, W) census codes.
        grey: (h, w) of the left view; edges in it make jumps cheaper.
        first_partner: right column of the left column 0 at the first disparity.
        penalties: p1; p2; cost without a partner; grey step that halves p2.
        is_backward: scan from the last pixel to the first.
        total: (h, w, n) in place, path costs are added.
    """
    height, width, n = total.shape
    p1, p2, no_partner, edge_grey = penalties
    # Rows: this one, the one before, and the start of a path, which stays 0. Paths: from the row
    # before, left, above and right; and from the side.
    paths = np.full((3, width, 4, n + 2), _FAR, dtype=np.int16)
    paths[_START] = 0
    lowest = np.zeros((3, width, 4), dtype=np.int16)
    cost = np.empty(n, dtype=np.int16)
    step = -1 if is_backward else 1
    for iy in range(height):
        y = height - 1 - iy if is_backward else iy
        now = iy % 2
        for ix in range(width):
            x = width - 1 - ix if is_backward else ix
            census_cost(left[y, x], right, y, x + first_partner, no_partner, cost)
            for j in range(4):
                is_side = j == 3
                xb = x - step if is_side else x + j - 1
                yb = y if is_side else y - step
                if 0 <= xb < width and 0 <= yb < height:
                    then = now if is_side else 1 - now
                    step_grey = np.int64(grey[y, x]) - np.int64(grey[yb, xb])
                    jump = jump_penalty(p1, p2, edge_grey, step_grey)
                else:
                    then, xb, jump = _START, 0, p2
                extend_path(
                    paths, lowest, (j, then, xb, now), cost, (p1, jump), (y, x), total
                )  # fmt: skip


@njit(cache=True, nogil=True)
def parabola_offset(before: float, lowest: float, after: float) -> float:
    """Where between -0.5 and 0.5 the parabola through three costs is lowest."""
    bend = before - 2.0 * lowest + after
    return 0.5 * (before - after) / bend if bend > 0.0 else 0.0


@njit(cache=True, nogil=True)
def least(sums: NDArray[np.int32], first: int, end: int) -> np.int32:
    """Minimum of sums[first:end]; the largest number when there is none."""
    lowest = _MOST_32
    if first < end:
        part = sums[first:end]
        for k in range(part.shape[0]):
            lowest = min(lowest, part[k])
    return lowest


@njit(cache=True, nogil=True)
def update_right(sums: NDArray[np.int32], first_partner: int, best: NDArray[np.int32]) -> None:
    """Offer one left pixel's sums (n,) to its partners.

    Args:
        sums: (n,), n at most 1024.
        first_partner: right column at the first disparity.
        best: (W,) in place, mirrored: lowest sum * 1024 + number of its disparity.

    Mirrored, packed and sliced, the loop is compiled to vectors: a sixth of the time.
    """
    mirrored = best.shape[0] - 1 - first_partner
    first, end = max(0, -mirrored), min(sums.shape[0], first_partner + 1)
    if first >= end:
        return
    offered = sums[first:end]
    partners = best[mirrored + first : mirrored + end]
    for j in range(offered.shape[0]):
        packed = np.int32(np.int32(offered[j] << _NUMBER_BITS) | np.int32(first + j))
        partners[j] = min(partners[j], packed)


@njit(cache=True, nogil=True)
def choose_rows(
    forward: NDArray[np.int16],
    backward: NDArray[np.int16],
    first_partner: int,
    lowest_px: int,
    rows: tuple[int, int],
    left_px: NDArray[np.float32],
    right_px: NDArray[np.float32],
    uniqueness: NDArray[np.float32],
) -> None:
    """Winner takes all in both views of one aggregated cost.

    The cost of right pixel u at disparity d is that of left pixel u + d: the volume's diagonal.

    Args:
        forward: (h, w, n) sums of the forward scan's paths.
        backward: (h, w, n) of the backward scan's.
        first_partner: right column of the left column 0 at the first disparity.
        lowest_px: first disparity.
        rows: first, and after the last, to fill.
        left_px: (h, w) in place, sub-pixel; NaN where the best is the first or last disparity.
        right_px: (h, W) in place, whole; NaN where no left pixel reaches.
        uniqueness: (h, w) in place: how much worse the best beyond the neighbours is, 0 to 1.
    """
    _, width, n = forward.shape
    right_width = right_px.shape[1]
    sums = np.empty(n, dtype=np.int32)
    right_best = np.empty(right_width, dtype=np.int32)
    for y in range(rows[0], rows[1]):
        right_best[:] = _MOST_32
        for x in range(width):
            lowest = _MOST_32
            for k in range(n):
                value = np.int32(np.int32(forward[y, x, k]) + np.int32(backward[y, x, k]))
                sums[k] = value
                lowest = min(lowest, value)
            best = 0
            while sums[best] != lowest:
                best += 1
            second = min(least(sums, 0, best - 1), least(sums, best + 2, n))
            gap = (np.float64(second) - np.float64(lowest)) / max(np.float64(lowest), 1.0)
            uniqueness[y, x] = min(gap, 1.0)
            left_px[y, x] = np.nan
            if 0 < best < n - 1:
                offset = parabola_offset(sums[best - 1], sums[best], sums[best + 1])
                left_px[y, x] = lowest_px + best + offset
            update_right(sums, x + first_partner, right_best)
        for u in range(right_width):
            packed = right_best[right_width - 1 - u]
            is_known = packed != _MOST_32
            right_px[y, u] = lowest_px + (packed & _NUMBER_MASK) if is_known else np.nan
