"""Compiled blending of the polynomials around the nodes of a grid into one surface."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# A node counts a little up to the far end of its cells, so that one alone is enough there.
_LEAST_SHARE = np.float32(1e-6)


@njit(cache=True, nogil=True)
def picture_rows(
    nodes: NDArray[np.float32],
    side: int,
    unit: np.float32,
    first: int,
    last: int,
    picture: NDArray[np.float32],
) -> None:
    """The blended surface at the pixels of the rows `first` to `last` (exclusive).

    Args:
        nodes: (rows, 7, columns) support, and support times the coefficients.
        side: px from node to node.
        unit: node distance in window radii.
        first: row.
        last: row after the last.
        picture: (h, w) in place; NaN where no node around has a polynomial.
    """
    n_cells = nodes.shape[2] - 1
    lines = np.empty((4, n_cells + 1), np.float32)
    blended = np.empty(n_cells, np.float32)
    for y in range(first, last):
        cell, step = divmod(y, side)
        _across(nodes[cell], nodes[cell + 1], step / side, unit, lines)
        for phase in range(side):
            _blend(lines, phase / side, unit, blended)
            row = picture[y, phase::side]
            for i in range(len(row)):
                row[i] = blended[i]


@njit(cache=True, nogil=True)
def _across(
    top: NDArray[np.float32],
    bottom: NDArray[np.float32],
    step: float,
    unit: np.float32,
    lines: NDArray[np.float32],
) -> None:
    """Two rows of nodes blended on a line between them: polynomials of u alone.

    Args:
        top: (7, n) nodes.
        bottom: (7, n) nodes below.
        step: 0 at the top nodes, 1 at the bottom ones.
        unit: node distance in window radii.
        lines: (4, n) in place: support, and support times the three coefficients.
    """
    below = np.float32(step)
    v, w = below * unit, (below - np.float32(1.0)) * unit
    a, b = np.float32(1.0) - below + _LEAST_SHARE, below + _LEAST_SHARE
    av, bw, avv, bww = a * v, b * w, a * v * v, b * w * w
    for i in range(lines.shape[1]):
        lines[0, i] = a * top[0, i] + b * bottom[0, i]
        of_v = a * top[1, i] + b * bottom[1, i] + (av * top[3, i] + bw * bottom[3, i])
        lines[1, i] = of_v + (avv * top[6, i] + bww * bottom[6, i])
        of_uv = av * top[5, i] + bw * bottom[5, i]
        lines[2, i] = a * top[2, i] + b * bottom[2, i] + of_uv
        lines[3, i] = a * top[4, i] + b * bottom[4, i]


@njit(cache=True, nogil=True, error_model="numpy")
def _blend(
    lines: NDArray[np.float32], step: float, unit: np.float32, out: NDArray[np.float32]
) -> None:
    """Neighbours on a line blended at one place between them, of every cell.

    Args:
        lines: (4, n + 1) of `_across`.
        step: 0 at the left nodes, 1 at the right ones.
        unit: node distance in window radii.
        out: (n,) in place; 0 / 0 where both nodes are without support.
    """
    n = len(out)
    below = np.float32(step)
    u, w = below * unit, (below - np.float32(1.0)) * unit
    a, b = np.float32(1.0) - below + _LEAST_SHARE, below + _LEAST_SHARE
    s, c, d, e = lines[0], lines[1], lines[2], lines[3]
    for i in range(n):
        left = c[i] + u * (d[i] + u * e[i])
        following = c[i + 1] + w * (d[i + 1] + w * e[i + 1])
        out[i] = (a * left + b * following) / (a * s[i] + b * s[i + 1])
