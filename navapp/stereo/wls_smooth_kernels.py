"""Compiled fast global smoother: tridiagonal solves along rows and columns."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def solve_rows(
    values: NDArray[np.float32],
    trust: NDArray[np.float32],
    picture: NDArray[np.int16],
    link_weight: NDArray[np.float32],
    strength: float,
    first: int,
    last: int,
) -> None:
    """Smooth every row of `first` to `last` (exclusive) along itself.

    Minimises sum c (u - f)^2 + strength * sum g (u_x - u_x+1)^2: one Thomas solve per row.

    Args:
        values: (h, w) f in, u out; finite everywhere.
        trust: (h, w) c; 0 where unknown: such a pixel stays as it is and carries nothing.
        picture: (h, w, 3).
        link_weight: (766,) g over the sum of the three absolute differences.
        strength: of this pass.
        first: row.
        last: row after the last.
    """
    width = values.shape[1]
    upper = np.empty(width)
    right = np.empty(width)
    for y in range(first, last):
        link = 0.0
        for x in range(width):
            c = trust[y, x]
            before = link
            link = 0.0
            if c <= 0.0:
                upper[x] = 0.0
                right[x] = values[y, x]
                continue
            if x + 1 < width and trust[y, x + 1] > 0.0:
                link = strength * link_weight[_step(picture, y, x, y, x + 1)]
            pivot = c + before + link
            pushed = c * values[y, x]
            if before > 0.0:
                pivot -= before * upper[x - 1]
                pushed += before * right[x - 1]
            upper[x] = link / pivot
            right[x] = pushed / pivot
        after = 0.0
        for x in range(width - 1, -1, -1):
            after = right[x] + upper[x] * after
            values[y, x] = after


@njit(cache=True, nogil=True)
def solve_columns(
    values: NDArray[np.float32],
    trust: NDArray[np.float32],
    picture: NDArray[np.int16],
    link_weight: NDArray[np.float32],
    strength: float,
    first: int,
    last: int,
) -> None:
    """Smooth every column of `first` to `last` (exclusive) along itself; see `solve_rows`.

    The columns are solved side by side, row by row, because memory runs along the rows.
    """
    height, n = values.shape[0], last - first
    upper = np.empty((height, n), dtype=np.float32)
    link = np.zeros(n, dtype=np.float32)
    for y in range(height):
        for k in range(n):
            x = first + k
            c = trust[y, x]
            before = link[k]
            after = np.float32(0.0)
            if c <= 0.0:
                upper[y, k] = 0.0
                link[k] = 0.0
                continue
            if y + 1 < height and trust[y + 1, x] > 0.0:
                after = np.float32(strength) * link_weight[_step(picture, y, x, y + 1, x)]
            link[k] = after
            pivot = c + before + after
            pushed = c * values[y, x]
            if before > 0.0:
                pivot -= before * upper[y - 1, k]
                pushed += before * values[y - 1, x]
            upper[y, k] = after / pivot
            values[y, x] = pushed / pivot
    for y in range(height - 2, -1, -1):
        for k in range(n):
            values[y, first + k] += upper[y, k] * values[y + 1, first + k]


@njit(cache=True, nogil=True)
def _step(picture: NDArray[np.int16], y: int, x: int, v: int, u: int) -> int:
    """Sum of the three absolute colour differences."""
    return (
        abs(int(picture[y, x, 0]) - int(picture[v, u, 0]))
        + abs(int(picture[y, x, 1]) - int(picture[v, u, 1]))
        + abs(int(picture[y, x, 2]) - int(picture[v, u, 2]))
    )
