"""Compiled robust quadratics around the nodes of a grid, eight neighbouring nodes at once.

Samples lie in planes: row y + reach holds row y of the samples, its columns sorted by their place
between two nodes. So what eight nodes read of a row is contiguous, and a margin without weight
spares every test for the border.
"""

from typing import Any, NamedTuple

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

# 1, u, v, u^2, uv, v^2.
_N_TERMS = 6
_POWER_OF_U = (0, 1, 0, 2, 1, 0)
_POWER_OF_V = (0, 0, 1, 0, 1, 2)
# What eight nodes have side by side in one array: polynomials; sums of weight, and of weight times
# residual, by power of u and of v; the equations.
_N_POWERS, _N_RIGHT_POWERS = 5, 3
_MOMENTS = _N_TERMS
_RIGHT = _MOMENTS + _N_POWERS * _N_POWERS
_BELOW = _RIGHT + _N_RIGHT_POWERS * _N_RIGHT_POWERS
_SCALED = _BELOW + (_N_TERMS + 1) * _N_TERMS
_N_STATE = _SCALED + (_N_TERMS + 1) * _N_TERMS


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


class Rules(NamedTuple):
    """How the fit works."""

    scales_px: NDArray[np.float32]  # residual that counts a quarter, by iteration
    ridge: NDArray[np.float32]  # (6,) added to the diagonal for each known sample
    min_samples: np.float32  # for a polynomial


@njit(cache=True, nogil=True)
def fit_rows(
    samples: Samples,
    window: Window,
    rules: Rules,
    first: int,
    last: int,
    nodes: NDArray[np.float32],
) -> None:
    """Polynomials of the nodes of the rows `first` to `last` (exclusive).

    Args:
        samples: in planes.
        window: of a node.
        rules: of the fit.
        first: row of nodes.
        last: row after the last.
        nodes: (rows, 7, columns) in place: support, and support times the coefficients of 1, u, v,
            u^2, uv, v^2; columns a multiple of `FLOAT_LANES`.
    """
    n_columns = nodes.shape[2]
    told = nodes.ravel()
    state = np.zeros(_N_STATE * FLOAT_LANES, np.float32)
    ranked = np.empty(len(window.start) * FLOAT_LANES, np.float32)
    counts = np.empty(FLOAT_LANES, np.float32)
    for j in range(first, last):
        for i in range(0, n_columns, FLOAT_LANES):
            begin = j * samples.spacing * samples.width + i
            _count_known(samples, window, begin, counts)
            if counts.max() >= rules.min_samples:
                state[: _N_TERMS * FLOAT_LANES] = np.float32(0.0)
                _medians(samples, window, begin, ranked, state)
                for scale in rules.scales_px:
                    _add_window(samples, window, begin, scale, state)
                    _solve(rules.ridge, counts, state)
            _tell(state, counts, rules.min_samples, n_columns, told[7 * j * n_columns + i :])


@njit(cache=True, nogil=True)
def _count_known(samples: Samples, window: Window, begin: int, counts: NDArray[np.float32]) -> None:
    """Known samples in the windows of eight nodes, from the place `begin` on."""
    one, zero = spread(np.float32(1.0)), spread(np.float32(0.0))
    count = zero
    for j in range(len(window.across)):
        for place in window.across:
            weight = load(samples.weights, begin + j * samples.width + place)
            count = count + where_positive(weight, one, zero)
    store(counts, 0, count)


@njit(cache=True, nogil=True)
def _medians(
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


@njit(cache=True, nogil=True, error_model="numpy")
def _add_window(
    samples: Samples, window: Window, begin: int, scale: np.float32, state: NDArray[np.float32]
) -> None:
    """Sums over the windows, weighed by the residual against the polynomials."""
    zero, one = spread(np.float32(0.0)), spread(np.float32(1.0))
    per_px = spread(np.float32(1.0) / scale)
    for k in range(_MOMENTS, _BELOW):
        store(state, k * FLOAT_LANES, zero)
    bend = load(state, 3 * FLOAT_LANES)
    for j in range(len(window.offsets)):
        v, taper = spread(window.offsets[j]), spread(window.taper[j])
        level = load(state, 0) + v * (
            load(state, 2 * FLOAT_LANES) + v * load(state, 5 * FLOAT_LANES)
        )
        slope = load(state, 1 * FLOAT_LANES) + v * load(state, 4 * FLOAT_LANES)
        s0, s1, s2, s3, s4 = zero, zero, zero, zero, zero
        r0, r1, r2 = zero, zero, zero
        place = begin + j * samples.width
        for i in range(len(window.offsets)):
            u = spread(window.offsets[i])
            at = place + window.across[i]
            residual = load(samples.values, at) - (level + u * (slope + u * bend))
            ratio = residual * per_px
            doubt = one + ratio * ratio
            w = load(samples.weights, at) * spread(window.taper[i]) / (doubt * doubt)
            s0, r, w = s0 + w, w * residual, w * u
            r0, r = r0 + r, r * u
            r1, r = r1 + r, r * u
            r2 = r2 + r
            s1, w = s1 + w, w * u
            s2, w = s2 + w, w * u
            s3, w = s3 + w, w * u
            s4 = s4 + w
        _add_row((s0, s1, s2, s3, s4), v, taper, _MOMENTS, state)
        _add_row((r0, r1, r2), v, taper, _RIGHT, state)


@njit(cache=True, nogil=True)
def _add_row(
    row: tuple[Any, ...], v: Any, taper: Any, sums: int, state: NDArray[np.float32]
) -> None:
    """Add the sums of a row, by power of u, times powers of v to those of the window."""
    n, factor = len(row), taper
    for q in range(n):
        for p in range(n - q):
            at = (sums + n * q + p) * FLOAT_LANES
            store(state, at, load(state, at) + factor * row[p])
        factor = factor * v


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(
    ridge: NDArray[np.float32], counts: NDArray[np.float32], state: NDArray[np.float32]
) -> None:
    """Improve the polynomials: square-root-free Cholesky, the right side is a seventh row."""
    one, count = spread(np.float32(1.0)), load(counts, 0)
    for j in range(_N_TERMS):
        p, q = _POWER_OF_U[j], _POWER_OF_V[j]
        for k in range(j, _N_TERMS):
            moment = _MOMENTS + _N_POWERS * (q + _POWER_OF_V[k]) + p + _POWER_OF_U[k]
            store(state, _below(k, j), load(state, moment * FLOAT_LANES))
        # The ridge draws all to zero but the level, which only moves less.
        small = spread(ridge[j]) * count
        drawn = load(state, (_RIGHT + _N_RIGHT_POWERS * q + p) * FLOAT_LANES)
        if j > 0:
            drawn = drawn - small * load(state, j * FLOAT_LANES)
        store(state, _below(j, j), load(state, _below(j, j)) + small)
        store(state, _below(_N_TERMS, j), drawn)
        for k in range(j, _N_TERMS + 1):
            left = load(state, _below(k, j))
            for m in range(j):
                left = left - load(state, _below(k, m)) * load(state, _scale(j, m))
            store(state, _below(k, j), left)
        pivot = load(state, _below(j, j))
        inverse = where_positive(pivot, one / pivot, one)
        for k in range(j + 1, _N_TERMS + 1):
            store(state, _scale(k, j), load(state, _below(k, j)) * inverse)
    for j in range(_N_TERMS - 1, -1, -1):
        change = load(state, _scale(_N_TERMS, j))
        for k in range(j + 1, _N_TERMS):
            change = change - load(state, _scale(k, j)) * load(state, _scale(_N_TERMS, k))
        store(state, _scale(_N_TERMS, j), change)
        store(state, j * FLOAT_LANES, load(state, j * FLOAT_LANES) + change)


@njit(cache=True, nogil=True)
def _below(k: int, j: int) -> int:
    """Where L D is."""
    return (_BELOW + k * _N_TERMS + j) * FLOAT_LANES


@njit(cache=True, nogil=True)
def _scale(k: int, j: int) -> int:
    """Where L is; its last row is the answer."""
    return (_SCALED + k * _N_TERMS + j) * FLOAT_LANES


@njit(cache=True, nogil=True, error_model="numpy")
def _tell(
    state: NDArray[np.float32],
    counts: NDArray[np.float32],
    min_samples: np.float32,
    n_columns: int,
    told: NDArray[np.float32],
) -> None:
    """Hand out support, the mean weight, and polynomials; no support with too few samples."""
    for k in range(FLOAT_LANES):
        if counts[k] >= min_samples:
            told[k] = state[_MOMENTS * FLOAT_LANES + k] / counts[k]
        else:
            told[k] = np.float32(0.0)
    support, zero = load(told, 0), spread(np.float32(0.0))
    for term in range(_N_TERMS):
        told_term = where_positive(support, support * load(state, term * FLOAT_LANES), zero)
        store(told, (1 + term) * n_columns, told_term)
