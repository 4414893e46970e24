"""Compiled part of the pair's health: how far each point's partner lies above or below its row."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Of `values.Origin`, as a number for compiled code.
_MATCHED = 1
# The slope's ends and the partner's neighbours are read beside the window.
_MARGIN_PX = 2
# So much of a window is measured at least.
_LEAST_FILLED = 0.5
_LEAST_DETERMINANT = 1e-6


@njit(cache=True, nogil=True)
def measure_rows(
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    disparity: NDArray[np.float32],
    origin: NDArray[np.uint8],
    place: tuple[int, int],
    layout: tuple[int, int],
    row_shift_px: float,
    found: NDArray[np.float64],
) -> int:
    """Vertical offset of the partners of points on a grid: one step of least squares each.

    In a window around a point, the left values l are explained by the partner's values r, seen at
    x - d and `row_shift_px` further down, and by the left slopes: l = a + b r + dx l_x + dy l_y.
    The step along the row takes up what the disparity is off by, or it would leak into dy.

    Args:
        left: (H, W) rectified picture.
        right: (H, W) its partner.
        disparity: (h, w) px.
        origin: (h, w) of `values.Origin`: only what was matched counts.
        place: column and row of its first pixel in the picture.
        layout: distance of points and radius of windows, px.
        row_shift_px: see above.
        found: (n, 5) in place: the partner's rows below the point's, the standard deviation that
            the residual gives it, the correlation of l and r, and the point's column and row.

    Returns:
        How many rows of `found` hold.

    Source: Lucas and Kanade 1981, with gain and offset.
    """
    height, width = disparity.shape
    rows, columns = left.shape
    stride, radius = layout
    whole = int(np.floor(row_shift_px))
    part = row_shift_px - whole
    least = _LEAST_FILLED * (2 * radius + 1) ** 2
    sums = np.empty((5, 5))
    term = np.empty(5)
    n = 0
    for v in range(radius, height - radius, stride):
        top = place[1] + v - radius - _MARGIN_PX + min(whole, 0)
        bottom = place[1] + v + radius + _MARGIN_PX + max(whole, 0)
        if top < 0 or bottom >= rows:
            continue
        for u in range(radius, width - radius, stride):
            if n == len(found):
                return n
            first, last = place[0] + u - radius - _MARGIN_PX, place[0] + u + radius + _MARGIN_PX
            if first < 0 or last >= columns:
                continue
            sums[:] = 0.0
            for y in range(v - radius, v + radius + 1):
                for x in range(u - radius, u + radius + 1):
                    if origin[y, x] != _MATCHED:
                        continue
                    seen = place[0] + x - disparity[y, x]
                    column = int(np.floor(seen))
                    if column < 0 or column + 1 >= columns:
                        continue
                    t = seen - column
                    row = place[1] + y + whole
                    above = (1.0 - t) * right[row, column] + t * right[row, column + 1]
                    below = (1.0 - t) * right[row + 1, column] + t * right[row + 1, column + 1]
                    i, j = place[1] + y, place[0] + x
                    term[0] = 1.0
                    term[1] = (1.0 - part) * above + part * below
                    term[2] = 0.5 * (float(left[i, j + 1]) - float(left[i, j - 1]))
                    term[3] = 0.5 * (float(left[i + 1, j]) - float(left[i - 1, j]))
                    term[4] = float(left[i, j])
                    for a in range(5):
                        for b in range(a, 5):
                            sums[a, b] += term[a] * term[b]
            if sums[0, 0] >= least and _solve(sums, found[n]):
                found[n, 0] += row_shift_px
                found[n, 3], found[n, 4] = place[0] + u, place[1] + v
                n += 1
    return n


@njit(cache=True, nogil=True)
def _solve(sums: NDArray[np.float64], answer: NDArray[np.float64]) -> bool:
    """dy, its standard deviation and the correlation, of the sums of one window."""
    n = sums[0, 0]
    # Means removed: unknowns b, dx, dy.
    m = np.empty((4, 4))
    for a in range(4):
        for b in range(a, 4):
            m[a, b] = m[b, a] = sums[a + 1, b + 1] - sums[0, a + 1] * sums[0, b + 1] / n
    scale = m[0, 0] * m[1, 1] * m[2, 2]
    if scale <= 0.0 or m[3, 3] <= 0.0:
        return False
    c00 = m[1, 1] * m[2, 2] - m[1, 2] * m[1, 2]
    c01 = m[0, 2] * m[1, 2] - m[0, 1] * m[2, 2]
    c02 = m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]
    c11 = m[0, 0] * m[2, 2] - m[0, 2] * m[0, 2]
    c12 = m[0, 1] * m[0, 2] - m[0, 0] * m[1, 2]
    c22 = m[0, 0] * m[1, 1] - m[0, 1] * m[0, 1]
    determinant = m[0, 0] * c00 + m[0, 1] * c01 + m[0, 2] * c02
    if determinant < _LEAST_DETERMINANT * scale:
        return False
    gain = (c00 * m[0, 3] + c01 * m[1, 3] + c02 * m[2, 3]) / determinant
    along = (c01 * m[0, 3] + c11 * m[1, 3] + c12 * m[2, 3]) / determinant
    across = (c02 * m[0, 3] + c12 * m[1, 3] + c22 * m[2, 3]) / determinant
    left_over = m[3, 3] - gain * m[0, 3] - along * m[1, 3] - across * m[2, 3]
    answer[0] = across
    answer[1] = np.sqrt(max(left_over, 0.0) / (n - 4.0) * c22 / determinant)
    answer[2] = m[0, 3] / np.sqrt(m[0, 0] * m[3, 3])
    return True
