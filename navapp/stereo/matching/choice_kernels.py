"""Compiled choice of both views' disparities from the paths of both scans."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.lane_kernels import (
    WHOLE_LANES,
    larger,
    load,
    smaller,
    smallest,
    spread,
    store,
    where_positive,
    widened,
)
from navapp.stereo.matching.sgm_kernels import (
    Paths,
    Surplus,
    Views,
    census_cost,
    extend_paths,
    step_to,
)

_MOST_16 = np.uint16(65535)
_MOST_32 = np.uint32(4294967295)
_NUMBER_BITS = np.uint32(16)
_NUMBER_MASK = np.uint32(65535)
_UPPER_HALF = np.uint32(65536)
_N_PATHS = np.uint16(8)


class Choice(NamedTuple):
    """Disparities of both views."""

    # (h, w), sub-pixel; NaN where the best is the first or last disparity.
    left_px: NDArray[np.float32]
    right_px: NDArray[np.float32]  # (h, W), whole; NaN where no left pixel reaches
    # (h, w): how much worse the best beyond the neighbours is, 0 to 1.
    uniqueness: NDArray[np.float32]
    lowest_px: int  # first disparity
    n_disparities: int  # number of disparities; more only fill up the lanes


@njit(cache=True, nogil=True, forceinline=True)
def add_up(
    surplus: Surplus,
    kept: Surplus,
    first: int,
    cost: NDArray[np.uint8],
    sums: NDArray[np.uint16],
) -> None:
    """Sum of eight paths to one pixel.

    Args:
        surplus: (n,) what four paths cost more than the pixel itself.
        kept: the same of the other four, in n places,
        first: from this one on.
        cost: (n,) matching cost of the pixel.
        sums: (n,) in place.
    """
    for k in range(0, sums.shape[0], WHOLE_LANES):
        both = widened(load(surplus, k), sums) + widened(load(kept, first + k), sums)
        store(sums, k, both + widened(load(cost, k), sums) * spread(_N_PATHS))


@njit(cache=True, nogil=True, forceinline=True)
def offer(
    sums: NDArray[np.uint16],
    numbers: NDArray[np.uint16],
    right_best: NDArray[np.uint32],
    first: int,
) -> np.uint32:
    """Offer one left pixel's sums to its partners.

    A sum is offered as sum * 65536 + number of its disparity: of equal sums the smallest disparity
    is best, whatever comes first.

    Args:
        sums: (n,).
        numbers: (n,) 0, 1, 2, ...
        right_best: best offers in place, columns from right to left.
        first: place of the partner at the first disparity.

    Returns:
        The pixel's own best offer.
    """
    lowest = spread(_MOST_32)
    for k in range(0, sums.shape[0], WHOLE_LANES):
        upper_half = widened(load(sums, k), right_best) * spread(_UPPER_HALF)
        offered = upper_half | widened(load(numbers, k), right_best)
        store(right_best, first + k, smaller(load(right_best, first + k), offered))
        lowest = smaller(lowest, offered)
    best: np.uint32 = smallest(lowest)
    return best


@njit(cache=True, nogil=True, forceinline=True)
def second_least(best: int, sums: NDArray[np.uint16], numbers: NDArray[np.uint16]) -> np.uint16:
    """Minimum of the sums (n,) without the best one and its neighbours."""
    nothing = spread(_MOST_16)
    before, two = spread(np.uint16(best - 1)), spread(np.uint16(2))
    lowest = nothing
    for k in range(0, sums.shape[0], WHOLE_LANES):
        # Smaller numbers wrap around and become large ones.
        beyond = larger(load(numbers, k) - before, two) - two
        lowest = smaller(lowest, where_positive(beyond, load(sums, k), nothing))
    second: np.uint16 = smallest(lowest)
    return second


@njit(cache=True, nogil=True)
def parabola_offset(before: float, lowest: float, after: float) -> float:
    """Where between -0.5 and 0.5 the parabola through three costs is lowest."""
    bend = before - 2.0 * lowest + after
    return 0.5 * (before - after) / bend if bend > 0.0 else 0.0


@njit(cache=True, nogil=True, forceinline=True)
def choose_left(
    sums: NDArray[np.uint16],
    numbers: NDArray[np.uint16],
    best_offer: np.uint32,
    disparities: tuple[int, int],
) -> tuple[float, float]:
    """Winner takes all.

    Args:
        sums: (n,) of one left pixel.
        numbers: (n,) 0, 1, 2, ...
        best_offer: see `offer`.
        disparities: the first, px; their number.

    Returns:
        Disparity; how much worse the best beyond the neighbours is.
    """
    lowest_px, count = disparities
    best, lowest = np.int64(best_offer & _NUMBER_MASK), np.float64(best_offer >> _NUMBER_BITS)
    disparity_px = np.nan
    if 0 < best < count - 1:
        before, after = np.float64(sums[best - 1]), np.float64(sums[best + 1])
        disparity_px = lowest_px + best + parabola_offset(before, lowest, after)
    gap = np.float64(second_least(best, sums, numbers)) - lowest
    return disparity_px, min(gap / max(lowest, 1.0), 1.0)


@njit(cache=True, nogil=True)
def choose_rows(
    views: Views,
    paths: Paths,
    rows: tuple[int, int],
    direction: int,
    kept: Surplus,
    choice: Choice,
) -> None:
    """Follow four of the eight paths, add the other four, choose in both views.

    The cost of right pixel u at disparity d is that of left pixel u + d: the volume's diagonal.

    Args:
        views: what is matched.
        paths: as the row before left them, in place.
        rows: first row, and the one after the last, in the scan's order.
        direction: 1 for the scan from the first pixel to the last, -1 for the other.
        kept: (h, w, n) of the other scan, see `keep_rows`; only these rows are read.
        choice: these rows in place.
    """
    # Taken out of the tuples once: each time would count a reference.
    left, mirrored, grey, first_partner, p1, jumps, no_partner, outside, beyond = views
    costs, lowest, cost = paths
    left_px, right_px, uniqueness, lowest_px, count = choice
    _, width, n = kept.shape
    right_width = right_px.shape[1]
    surplus, sums = np.empty(n, dtype=kept.dtype), np.empty((width, n), dtype=np.uint16)
    offers = np.empty(width, dtype=np.uint32)
    numbers = np.arange(n).astype(np.uint16)
    # As wide as the mirrored codes: partners outside fall into the margin.
    right_best = np.empty(right_width + 2 * n, dtype=np.uint32)
    for y in range(rows[0], rows[1], direction):
        right_best[:] = _MOST_32
        for ix in range(width):
            x = ix if direction > 0 else width - 1 - ix
            u = x + first_partner
            census_cost(left, mirrored, outside, beyond, (y, x, u), no_partner, cost)
            step = step_to(grey, jumps, (y, x), direction)
            extend_paths(costs, lowest, cost, step, p1, surplus, 0)
            add_up(surplus, kept, (y * width + x) * n, cost, sums[x])
            first = n + min(max(right_width - 1 - u, -n), right_width)
            offers[x] = offer(sums[x], numbers, right_best, first)
        # Apart from the paths, where each pixel waits for the one before.
        for x in range(width):
            left_px[y, x], uniqueness[y, x] = choose_left(
                sums[x], numbers, offers[x], (lowest_px, count)
            )
        for u in range(right_width):
            best = right_best[n + right_width - 1 - u]
            number = np.int64(best & _NUMBER_MASK)
            # What only fills up the lanes wins where there is nothing else.
            is_known = best != _MOST_32 and number < count
            right_px[y, u] = lowest_px + number if is_known else np.nan
