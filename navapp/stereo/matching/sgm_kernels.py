"""Compiled semi-global aggregation of census distances.

Costs are bytes: a census distance (at most 64) and the penalty of a jump (at most 191) fit. 255
means "no such disparity" and stays so, because sums stop there.

Functions that are called for every pixel are inlined by force: handing over a dozen arrays would
take a third of the time.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.lane_kernels import (
    WHOLE_LANES,
    capped_sum,
    larger,
    load,
    ones,
    smaller,
    smallest,
    spread,
    store,
    where_positive,
    widened,
)

# Of four paths: slots that they come from, slots to fill, penalties of a jump.
Slots = tuple[int, int, int, int]
Step = tuple[Slots, Slots, tuple[np.uint8, np.uint8, np.uint8, np.uint8]]

Surplus = NDArray[np.uint8] | NDArray[np.uint16]

NONE = np.uint8(255)
MAX_PENALTY = 191
# From the row before: from its pixel at the left, above and at the right.
_ROW_PATHS = 3


class Views(NamedTuple):
    """What is matched; n is a multiple of `WHOLE_LANES`."""

    left: NDArray[np.uint8]  # (h, bytes, w) census codes
    # (h, bytes, n + W + n) codes of the right view, columns from right to left, with a margin:
    # growing disparities are neighbours in memory.
    mirrored: NDArray[np.uint8]
    grey: NDArray[np.uint8]  # (h, w) of the left view; edges in it make jumps cheaper
    first_partner: int  # right column of the left column 0 at the first disparity
    p1: np.uint8  # penalty of a step of one disparity
    jumps: NDArray[np.uint8]  # (256,) penalty of any other step, by the grey step
    no_partner: np.uint8  # cost where the partner is outside the right view
    outside: NDArray[np.uint8]  # (n + W + n,) 255 in the margin, 0 elsewhere
    beyond: NDArray[np.uint8]  # (n,) 255 for disparities that only fill up the lanes, 0 elsewhere


class Paths(NamedTuple):
    """Where the paths of one scan stand; made by `new_paths`."""

    # (slots, 1 + n + 1) path costs; 255 at either end. Three slots for each pixel of two rows, two
    # for the path from the side, one for paths that start.
    costs: NDArray[np.uint8]
    lowest: NDArray[np.uint8]  # (slots,) minimum of each
    cost: NDArray[np.uint8]  # (n,) matching cost of one pixel


def new_paths(width: int, n: int) -> Paths:
    """Before the first pixel of a scan."""
    n_slots = 2 * width * _ROW_PATHS + 3
    costs = np.full((n_slots, n + 2), NONE, dtype=np.uint8)
    # A path that starts has cost nothing yet.
    costs[-1, 1:-1] = 0
    return Paths(costs, np.zeros(n_slots, dtype=np.uint8), np.empty(n, dtype=np.uint8))


def mirror_codes(codes: NDArray[np.uint8], n: int) -> NDArray[np.uint8]:
    """`Views.mirrored` of (h, bytes, W) codes."""
    height, n_bytes, width = codes.shape
    out = np.zeros((height, n_bytes, width + 2 * n), dtype=np.uint8)
    out[:, :, n : n + width] = codes[:, :, ::-1]
    return out


def jump_penalties(p1: int, p2: int, edge_grey: int) -> NDArray[np.uint8]:
    """(256,) penalty of a jump of the disparity: smaller across an edge, always above p1."""
    return np.maximum(p1 + 1, p2 // (1 + np.arange(256) // edge_grey)).astype(np.uint8)


def surplus_dtype(p2: int) -> type[np.uint8] | type[np.uint16]:
    """What holds four jumps: a byte for the usual penalties, half of the memory to go through."""
    return np.uint8 if 4 * p2 <= NONE else np.uint16


@njit(cache=True, nogil=True, forceinline=True)
def census_cost(
    left: NDArray[np.uint8],
    mirrored: NDArray[np.uint8],
    outside: NDArray[np.uint8],
    beyond: NDArray[np.uint8],
    place: tuple[int, int, int],
    no_partner: np.uint8,
    cost: NDArray[np.uint8],
) -> None:
    """Hamming distances of a left pixel to its partners.

    Args:
        left: see `Views`, like all that is not said here.
        mirrored: codes.
        outside: no partners.
        beyond: no disparities.
        place: y; x; right column of the first partner.
        no_partner: cost.
        cost: (n,) in place.
    """
    y, x, u = place
    n = cost.shape[0]
    _, n_bytes, row_length = mirrored.shape
    right_width = row_length - 2 * n
    first = right_width - 1 - u
    # However far outside, all partners lie in the margin.
    column = n + min(max(first, -n), right_width)
    for k in range(0, n, WHOLE_LANES):
        distance = spread(np.uint8(0))
        for byte in range(n_bytes):
            partners = load(mirrored, (y * n_bytes + byte) * row_length + column + k)
            distance = distance + ones(spread(left[y, byte, x]) ^ partners)
        store(cost, k, larger(distance, load(beyond, k)))
    if first < 0 or first + n > right_width:
        for k in range(0, n, WHOLE_LANES):
            known = where_positive(load(outside, column + k), spread(no_partner), load(cost, k))
            store(cost, k, larger(known, load(beyond, k)))


@njit(cache=True, nogil=True, forceinline=True)
def _surplus(
    costs: NDArray[np.uint8], before: int, near_penalty: Any, highest: Any, lowest: Any
) -> Any:
    """Lanes of what one path adds to the cost; `before` is the place of the disparity one lower."""
    neighbours = smaller(load(costs, before), load(costs, before + 2))
    near = capped_sum(neighbours, near_penalty)
    return smaller(smaller(load(costs, before + 1), near), highest) - lowest


@njit(cache=True, nogil=True, forceinline=True)
def extend_paths(
    costs: NDArray[np.uint8],
    lowest: NDArray[np.uint8],
    cost: NDArray[np.uint8],
    step: Step,
    p1: np.uint8,
    surplus: Surplus,
    first: int,
) -> None:
    """One step of four paths to the same pixel.

    Args:
        costs: see `Paths`, in place.
        lowest: see `Paths`, in place.
        cost: (n,) of the pixel.
        step: from where to where.
        p1: penalty of a step of one disparity.
        surplus: of `surplus_dtype`; what the four paths cost more than four times the pixel goes to
            n places,
        first: from this one on.

    Source: Hirschmueller 2008, equation (13). All four in one loop, because the cost is read and
    the surplus is written once.
    """
    before, now, jumps = step
    slot = costs.shape[1]
    near = spread(p1)
    low_a, low_b = spread(lowest[before[0]]), spread(lowest[before[1]])
    low_c, low_d = spread(lowest[before[2]]), spread(lowest[before[3]])
    high_a, high_b = low_a + spread(jumps[0]), low_b + spread(jumps[1])
    high_c, high_d = low_c + spread(jumps[2]), low_d + spread(jumps[3])
    least_a = least_b = least_c = least_d = spread(NONE)
    for k in range(0, cost.shape[0], WHOLE_LANES):
        here = load(cost, k)
        a = _surplus(costs, before[0] * slot + k, near, high_a, low_a)
        b = _surplus(costs, before[1] * slot + k, near, high_b, low_b)
        c = _surplus(costs, before[2] * slot + k, near, high_c, low_c)
        d = _surplus(costs, before[3] * slot + k, near, high_d, low_d)
        two = widened(a, surplus) + widened(b, surplus)
        other_two = widened(c, surplus) + widened(d, surplus)
        store(surplus, first + k, two + other_two)
        a, b, c, d = (
            capped_sum(a, here), capped_sum(b, here), capped_sum(c, here), capped_sum(d, here)
        )  # fmt: skip
        store(costs, now[0] * slot + 1 + k, a)
        store(costs, now[1] * slot + 1 + k, b)
        store(costs, now[2] * slot + 1 + k, c)
        store(costs, now[3] * slot + 1 + k, d)
        least_a, least_b = smaller(least_a, a), smaller(least_b, b)
        least_c, least_d = smaller(least_c, c), smaller(least_d, d)
    lowest[now[0]], lowest[now[1]] = smallest(least_a), smallest(least_b)
    lowest[now[2]], lowest[now[3]] = smallest(least_c), smallest(least_d)


@njit(cache=True, nogil=True, forceinline=True)
def step_to(
    grey: NDArray[np.uint8], jumps: NDArray[np.uint8], pixel: tuple[int, int], direction: int
) -> Step:
    """The step of one scan's four paths to a pixel.

    Args:
        grey: see `Views`.
        jumps: see `Views`.
        pixel: y, x.
        direction: 1 for the scan from the first pixel to the last, -1 for the other.
    """
    y, x = pixel
    height, width = grey.shape
    side = 2 * width * _ROW_PATHS
    start = side + 2
    yb, xb = y - direction, x - direction
    has_row, has_side = 0 <= yb < height, 0 <= xb < width
    slot = ((yb & 1) * width + x) * _ROW_PATHS
    before = (
        slot - _ROW_PATHS if has_row and x > 0 else start,
        slot + 1 if has_row else start,
        slot + _ROW_PATHS + 2 if has_row and x < width - 1 else start,
        side + (xb & 1) if has_side else start,
    )
    slot = ((y & 1) * width + x) * _ROW_PATHS
    now = (slot, slot + 1, slot + 2, side + (x & 1))
    # No path jumps where it starts: any pixel will do there.
    yb, xb = min(max(yb, 0), height - 1), min(max(xb, 0), width - 1)
    here = np.int64(grey[y, x])
    penalties = (
        jumps[abs(here - np.int64(grey[yb, max(x - 1, 0)]))],
        jumps[abs(here - np.int64(grey[yb, x]))],
        jumps[abs(here - np.int64(grey[yb, min(x + 1, width - 1)]))],
        jumps[abs(here - np.int64(grey[y, xb]))],
    )
    return before, now, penalties


@njit(cache=True, nogil=True)
def keep_rows(
    views: Views, paths: Paths, rows: tuple[int, int], direction: int, kept: Surplus
) -> None:
    """Follow four of the eight paths, those that one scan meets, and keep what they add.

    Args:
        views: what is matched.
        paths: as the row before left them, in place.
        rows: first row, and the one after the last, in the scan's order.
        direction: 1 for the scan from the first pixel to the last, -1 for the other.
        kept: (h, w, n) surplus in place, see `extend_paths`.
    """
    # Taken out of the tuples once: each time would count a reference.
    left, mirrored, grey, first_partner, p1, jumps, no_partner, outside, beyond = views
    costs, lowest, cost = paths
    _, width, n = kept.shape
    for y in range(rows[0], rows[1], direction):
        for ix in range(width):
            x = ix if direction > 0 else width - 1 - ix
            place = (y, x, x + first_partner)
            census_cost(left, mirrored, outside, beyond, place, no_partner, cost)
            step = step_to(grey, jumps, (y, x), direction)
            extend_paths(costs, lowest, cost, step, p1, kept, (y * width + x) * n)
