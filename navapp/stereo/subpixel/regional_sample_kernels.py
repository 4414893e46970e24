"""Compiled samples of a robust regression: where they lie, how many there are, their medians.

Samples lie in planes: row y + reach holds row y of the samples, its columns sorted by their place
between two nodes. So what eight nodes read of a row is contiguous, and a margin without weight
spares every test for the border.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.lane_kernels import (
    FLOAT_LANES,
    larger,
    load,
    smaller,
    spread,
    store,
    where_positive,
)


class Samples(NamedTuple):
    """What is fitted."""

    values: NDArray[np.float32]  # (rows * width,) px
    weights: NDArray[np.float32]  # the same size, 0 where nothing is known
    width: int  # elements from row to row
    stride: int  # elements from place to place between two nodes
    spacing: int  # samples from node to node, each way
    reach: int  # rows above the first sample
    margin: int  # elements before the first sample of each place


class Window(NamedTuple):
    """What a node sees; element k is the sample k - reach, each way."""

    across: NDArray[np.intp]  # (n,) places in a row of the planes, of the first node
    offsets: NDArray[np.float32]  # (n,) distance in window radii
    taper: NDArray[np.float32]  # (n,) weight by that
    # places in the planes of the samples that the first polynomial is the median of.
    start: NDArray[np.intp]


@njit(cache=True, nogil=True)
def place_rows(
    samples_px: NDArray[np.float32],
    weights: NDArray[np.float32],
    first: int,
    last: int,
    samples: Samples,
) -> None:
    """Put the rows `first` to `last` (exclusive) of the samples into the planes.

    Args:
        samples_px: (rows, columns), not finite where unknown.
        weights: the same size.
        first: row.
        last: row after the last.
        samples: in place.
    """
    for y in range(first, last):
        for phase in range(samples.spacing):
            begin = (y + samples.reach) * samples.width + phase * samples.stride + samples.margin
            row = samples_px[y, phase :: samples.spacing]
            given = weights[y, phase :: samples.spacing]
            values = samples.values[begin : begin + len(row)]
            kept = samples.weights[begin : begin + len(row)]
            for i in range(len(row)):
                counts = (given[i] > np.float32(0.0)) & np.isfinite(row[i])
                values[i] = row[i] if counts else np.float32(0.0)
                kept[i] = given[i] if counts else np.float32(0.0)


@njit(cache=True, nogil=True)
def count_known(samples: Samples, window: Window, begin: int, counts: NDArray[np.float32]) -> None:
    """Known samples in the windows of eight nodes, from the place `begin` on."""
    one, zero = spread(np.float32(1.0)), spread(np.float32(0.0))
    count = zero
    for j in range(len(window.across)):
        for place in window.across:
            weight = load(samples.weights, begin + j * samples.width + place)
            count = count + where_positive(weight, one, zero)
    store(counts, 0, count)


@njit(cache=True, nogil=True)
def medians(
    samples: Samples,
    window: Window,
    begin: int,
    ranked: NDArray[np.float32],
    found: NDArray[np.float32],
) -> None:
    """Medians of some samples around eight nodes; 0 without any."""
    one, zero = spread(np.float32(1.0)), spread(np.float32(0.0))
    nothing = spread(np.float32(np.inf))
    count = zero
    for k in range(len(window.start)):
        weight = load(samples.weights, begin + window.start[k])
        value = load(samples.values, begin + window.start[k])
        store(ranked, k * FLOAT_LANES, where_positive(weight, value, nothing))
        count = count + where_positive(weight, one, zero)
    _sort(ranked)
    store(found, 0, count)
    for k in range(FLOAT_LANES):
        n = int(found[k])
        low, high = ranked[(max(n, 1) - 1) // 2 * FLOAT_LANES + k], ranked[n // 2 * FLOAT_LANES + k]
        found[k] = np.float32(0.5) * (low + high) if n > 0 else np.float32(0.0)


@njit(cache=True, nogil=True)
def _sort(ranked: NDArray[np.float32]) -> None:
    """Sort every lane.

    Source: Batcher's merge exchange, Knuth, The Art of Computer Programming 3, algorithm 5.2.2M.
    """
    n = len(ranked) // FLOAT_LANES
    largest = 1
    while 2 * largest < n:
        largest *= 2
    p = largest
    while p > 0:
        q, r, d = largest, 0, p
        while True:
            for i in range(n - d):
                if i & p == r:
                    low, high = load(ranked, i * FLOAT_LANES), load(ranked, (i + d) * FLOAT_LANES)
                    store(ranked, i * FLOAT_LANES, smaller(low, high))
                    store(ranked, (i + d) * FLOAT_LANES, larger(low, high))
            if q == p:
                break
            d, q, r = q - p, q // 2, p
        p //= 2
