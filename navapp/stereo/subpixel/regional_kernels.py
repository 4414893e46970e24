"""Compiled robust quadratics around the nodes of a grid, and their blend into one surface.

A quadratic is a sum over 1, u, v, u^2, uv, v^2: u to the right and v down from its node, in window
radii.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float32]

N_TERMS = 6
# A fit starts from the median of 50 to 99 of the samples, when there are as many.
_N_START = 50
# A node counts a little up to the far end of its cells, so that one alone is enough there.
_LEAST_SHARE = np.float32(1e-6)


class Rules(NamedTuple):
    """How a quadratic is fitted; lengths along the picture in samples."""

    node_step: int  # from node to node
    reach: int  # from a node to the rim of its window
    offsets: Floats  # (n,) u, or v, of the samples from one rim of the window to the other
    taper: Floats  # (n,) what each counts by that
    ridge: Floats  # (6,) added to the diagonal for each known sample
    scales_px: Floats  # residual that counts a quarter, by iteration
    min_samples: int  # known ones, for a quadratic


class Known(NamedTuple):
    """Known samples of one window of S samples; only the first n entries hold."""

    terms: Floats  # (6, S) 1, u, v, u^2, uv, v^2
    value_px: Floats  # (S,)
    weight: Floats  # (S,) as given, times the taper
    residual_px: Floats  # (S,) from a quadratic
    robust_weight: Floats  # (S,) weight by that residual


@njit(cache=True, nogil=True)
def fit_rows(
    samples_px: Floats, weights: Floats, rules: Rules, first: int, last: int, nodes: Floats
) -> None:
    """Quadratics of the nodes of the rows `first` to `last` (exclusive).

    Args:
        samples_px: (h, w) samples.
        weights: (h, w), 0 for a sample that is not known.
        rules: of the fit.
        first: row of nodes.
        last: row after the last.
        nodes: (rows, columns, 7) in place: support, which is the mean weight of the samples, 0
            without a quadratic; and its coefficients.
    """
    size = len(rules.offsets) ** 2
    known = Known(
        np.ones((N_TERMS, size), np.float32), np.empty(size, np.float32),
        np.empty(size, np.float32), np.empty(size, np.float32), np.empty(size, np.float32),
    )  # fmt: skip
    sums = np.empty((N_TERMS + 1, N_TERMS), np.float32)
    for j in range(first, last):
        for i in range(nodes.shape[1]):
            node = nodes[j, i]
            node[:] = np.float32(0.0)
            n = gather(samples_px, weights, rules, j * rules.node_step, i * rules.node_step, known)
            if n < rules.min_samples:
                continue
            node[1] = np.median(known.value_px[: n : max(n // _N_START, 1)])
            for scale_px in rules.scales_px:
                add_up(known, n, scale_px, node, sums)
                node[0] = sums[0, 0] / np.float32(n)
                improve(rules.ridge, n, sums, node)


@njit(cache=True, nogil=True)
def gather(samples_px: Floats, weights: Floats, rules: Rules, y: int, x: int, known: Known) -> int:
    """Collect the known samples of the window around the sample (y, x); how many there are."""
    height, width = samples_px.shape
    n, reach = 0, rules.reach
    terms = known.terms
    for row in range(max(y - reach, 0), min(y + reach + 1, height)):
        v, taper = rules.offsets[row - y + reach], rules.taper[row - y + reach]
        for column in range(max(x - reach, 0), min(x + reach + 1, width)):
            weight = weights[row, column]
            # Written in any case, and kept if known: branches that cannot be foreseen are slow.
            terms[1, n], terms[2, n] = rules.offsets[column - x + reach], v
            known.value_px[n] = samples_px[row, column]
            known.weight[n] = weight * taper * rules.taper[column - x + reach]
            n += int(weight > np.float32(0.0))
    for k in range(n):
        u, v = terms[1, k], terms[2, k]
        terms[3, k], terms[4, k], terms[5, k] = u * u, u * v, v * v
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def add_up(known: Known, n: int, scale_px: np.float32, node: Floats, sums: Floats) -> None:
    """Normal equations of a window, each sample weighed by its residual from the node's quadratic.

    Args:
        known: samples; residuals and weights in place.
        n: number of samples.
        scale_px: residual that counts a quarter.
        node: (7,) whose coefficients are read.
        sums: (7, 6) in place, weighted: products of two terms, lower triangle only; in the last
            row, products of a term and the residual.
    """
    terms, residual_px, robust_weight = known.terms, known.residual_px, known.robust_weight
    for k in range(n):
        residual = known.value_px[k]
        for term in range(N_TERMS):
            residual -= node[1 + term] * terms[term, k]
        doubt = np.float32(1.0) + (residual / scale_px) ** 2
        residual_px[k], robust_weight[k] = residual, known.weight[k] / (doubt * doubt)
    for a in range(N_TERMS):
        for b in range(a + 1):
            sums[a, b] = sum_products(robust_weight, terms[a], terms[b], n)
        sums[N_TERMS, a] = sum_products(robust_weight, terms[a], residual_px, n)


@njit(cache=True, nogil=True, fastmath={"reassoc"})
def sum_products(a: Floats, b: Floats, c: Floats, n: int) -> np.float32:
    """Sum of a b c over the first n entries, in any order: the compiler takes several at once."""
    total = np.float32(0.0)
    for k in range(n):
        total += a[k] * b[k] * c[k]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def improve(ridge: Floats, n: int, sums: Floats, node: Floats) -> None:
    """Move a node's coefficients to the least squares of its sums.

    Square-root-free Cholesky decomposition in place; the right side is a seventh row.

    Args:
        ridge: (6,) added to the diagonal for each sample. It draws every coefficient to zero but
            the level, which only moves less.
        n: number of samples.
        sums: (7, 6) of `add_up`; used up.
        node: (7,) in place.
    """
    for j in range(N_TERMS):
        drawn = ridge[j] * np.float32(n)
        sums[j, j] += drawn
        if j > 0:
            sums[N_TERMS, j] -= drawn * node[1 + j]
    for j in range(N_TERMS):
        for k in range(j + 1, N_TERMS):
            factor = sums[k, j] / sums[j, j]
            for m in range(k, N_TERMS + 1):
                sums[m, k] -= factor * sums[m, j]
    for j in range(N_TERMS - 1, -1, -1):
        left = sums[N_TERMS, j]
        for k in range(j + 1, N_TERMS):
            left -= sums[k, j] * sums[N_TERMS, k]
        sums[N_TERMS, j] = left / sums[j, j]
        node[1 + j] += sums[N_TERMS, j]


@njit(cache=True, nogil=True, error_model="numpy")
def blend_rows(
    nodes: Floats, node_px: int, radius_px: int, first: int, last: int, surface_px: Floats
) -> None:
    """The surface at the pixels of the rows `first` to `last` (exclusive).

    Each pixel is the mean of what the four nodes around say, by bilinear weight times support.

    Args:
        nodes: (rows, columns, 7) of `fit_rows`.
        node_px: from node to node.
        radius_px: of the window.
        first: row.
        last: row after the last.
        surface_px: (h, w) in place; NaN where no node around has a quadratic.
    """
    side, radius, one = np.float32(node_px), np.float32(radius_px), np.float32(1.0)
    for y in range(first, last):
        row, below = divmod(y, node_px)
        for x in range(surface_px.shape[1]):
            column, right = divmod(x, node_px)
            total, count = np.float32(0.0), np.float32(0.0)
            for j in range(2):
                v = np.float32(below - j * node_px)
                for i in range(2):
                    u = np.float32(right - i * node_px)
                    node = nodes[row + j, column + i]
                    across, down = one - abs(u) / side, one - abs(v) / side
                    share = node[0] * (across + _LEAST_SHARE) * (down + _LEAST_SHARE)
                    count += share
                    total += share * value_at(node, u / radius, v / radius)
            surface_px[y, x] = total / count


@njit(cache=True, nogil=True)
def value_at(node: Floats, u: np.float32, v: np.float32) -> np.float32:
    """Value of a node's quadratic at (u, v), px."""
    return np.float32(
        node[1] + u * (node[2] + u * node[4] + v * node[5]) + v * (node[3] + v * node[6])
    )
