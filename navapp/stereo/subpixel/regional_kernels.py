"""Compiled robust quadratics around the nodes of a grid, eight neighbouring nodes at once."""

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.lane_kernels import FLOAT_LANES, load, spread, store, where_positive
from navapp.stereo.subpixel.regional_sample_kernels import Samples, Window, count_known, medians

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
            count_known(samples, window, begin, counts)
            if counts.max() >= rules.min_samples:
                state[: _N_TERMS * FLOAT_LANES] = np.float32(0.0)
                medians(samples, window, begin, ranked, state)
                for scale in rules.scales_px:
                    _add_window(samples, window, begin, scale, state)
                    _solve(rules.ridge, counts, state)
            _tell(state, counts, rules.min_samples, n_columns, told[7 * j * n_columns + i :])


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
