"""Compiled local least squares: one Gauss-Newton step of every pixel's disparity."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Window sums: number of pixels; left, right, gradient; their products; gradient^2 x offset.
_N, _L, _R, _G, _LL, _RR, _GG, _LR, _LG, _RG, _O = range(11)
_N_SUMS = 11
_LARGEST_STEP_PX = 0.5


@njit(cache=True, nogil=True)
def sample_row(
    left: NDArray[np.float32],
    right: NDArray[np.float32],
    support: NDArray[np.float32],
    offset: NDArray[np.float32],
    right_column: int,
    terms: NDArray[np.float32],
) -> None:
    """Window terms of one row: the right picture resampled where the disparity points.

    Args:
        left: (w,) grey values, centred.
        right: (W,) grey values, centred.
        support: (w,) disparity px, NaN where there is none.
        offset: (w,) px that is added to it.
        right_column: column of the left row's first pixel in the right row.
        terms: (11, w) in place; all 0 where the partner is unknown or outside.

    Catmull-Rom with a = -0.5: it reproduces a ramp, and its derivative is exact.
    """
    for x in range(left.shape[0]):
        for k in range(_N_SUMS):
            terms[k, x] = 0.0
        d = support[x]
        if np.isnan(d):
            continue
        u = np.float32(x + right_column) - d - offset[x]
        i = int(np.floor(u))
        if i < 1 or i + 2 >= right.shape[0]:
            continue
        t = u - np.float32(i)
        p0, p1, p2, p3 = right[i - 1], right[i], right[i + 1], right[i + 2]
        a = np.float32(0.5) * (p2 - p0)
        b = p0 - np.float32(2.5) * p1 + np.float32(2.0) * p2 - np.float32(0.5) * p3
        c = np.float32(0.5) * (p3 - p0) + np.float32(1.5) * (p1 - p2)
        r = p1 + t * (a + t * (b + t * c))
        g = a + t * (np.float32(2.0) * b + np.float32(3.0) * t * c)
        value = left[x]
        terms[_N, x] = 1.0
        terms[_L, x] = value
        terms[_R, x] = r
        terms[_G, x] = g
        terms[_LL, x] = value * value
        terms[_RR, x] = r * r
        terms[_GG, x] = g * g
        terms[_LR, x] = value * r
        terms[_LG, x] = value * g
        terms[_RG, x] = r * g
        terms[_O, x] = g * g * offset[x]


@njit(cache=True, nogil=True)
def solve_window(sums: NDArray[np.float64], answer: NDArray[np.float64]) -> bool:
    """Gain and disparity step of one window; False when the window cannot tell.

    Minimises sum (l - b (r - g e))^2 over the gain b and the step e, all mean-free: a difference in
    brightness or contrast between the cameras does not move the answer.

    Args:
        sums: (11,) window sums.
        answer: (3,) in place: step px, its standard deviation px from the residual, correlation.
    """
    n = sums[_N]
    ll = sums[_LL] - sums[_L] * sums[_L] / n
    rr = sums[_RR] - sums[_R] * sums[_R] / n
    gg = sums[_GG] - sums[_G] * sums[_G] / n
    if ll < 1e-3 * n or rr < 1e-3 * n or gg < 1e-4 * n:
        return False
    lr = sums[_LR] - sums[_L] * sums[_R] / n
    lg = sums[_LG] - sums[_L] * sums[_G] / n
    rg = sums[_RG] - sums[_R] * sums[_G] / n
    determinant = rr * gg - rg * rg
    if determinant < 1e-3 * rr * gg:
        return False
    gain = (lr * gg - lg * rg) / determinant
    if gain < 0.2 or gain > 5.0:
        return False
    gain_step = (lr * rg - lg * rr) / determinant
    residual = max(ll - gain * lr + gain_step * lg, 0.0)
    variance = residual / max(n - 3.0, 1.0) * rr / (determinant * gain * gain)
    answer[0] = gain_step / gain
    answer[1] = np.sqrt(variance)
    answer[2] = lr / np.sqrt(ll * rr)
    return True


@njit(cache=True, nogil=True)
def refine_rows(
    left: NDArray[np.float32],
    right: NDArray[np.float32],
    support: NDArray[np.float32],
    offset: NDArray[np.float32],
    right_column: int,
    radius: int,
    min_filled: float,
    first_row: int,
    last_row: int,
    refined: NDArray[np.float32],
    step: NDArray[np.float32],
    sigma: NDArray[np.float32],
    correlation: NDArray[np.float32],
) -> None:
    """One step for the rows first_row .. last_row - 1 (rows around them are read).

    The step is what the window as a whole lacks, so it is added to the window's mean offset, each
    pixel counted by its squared gradient as in the step itself. Added to the pixel's own offset,
    what one pixel has too much would never be corrected, and grows.

    Args:
        left: (h, w), centred grey values of the box.
        right: (h, W) of the same rows.
        support: (h, w) disparity px; NaN where there is none.
        offset: (h, w) px now, added to the support.
        right_column: column of the box's first pixel in `right`.
        radius: of the square window.
        min_filled: share of the window that must have support.
        first_row: of the band.
        last_row: after the band.
        refined: (h, w) in place, the new offset px; the window's mean where it cannot tell.
        step: (h, w) in place, px; NaN where the window cannot tell.
        sigma: (h, w) in place, px.
        correlation: (h, w) in place.
    """
    height, width = left.shape
    size = 2 * radius + 1
    ring = np.zeros((size, _N_SUMS, width), dtype=np.float32)
    columns = np.zeros((_N_SUMS, width))
    sums = np.zeros(_N_SUMS)
    answer = np.zeros(3)
    for y in range(first_row - radius, last_row + radius):
        terms = ring[(y - first_row + radius) % size]
        for k in range(_N_SUMS):
            for x in range(width):
                columns[k, x] -= terms[k, x]
        if 0 <= y < height:
            sample_row(left[y], right[y], support[y], offset[y], right_column, terms)
        else:
            terms[:] = 0.0
        for k in range(_N_SUMS):
            for x in range(width):
                columns[k, x] += terms[k, x]
        row = y - radius
        if row < first_row or row >= last_row:
            continue
        for k in range(_N_SUMS):
            sums[k] = columns[k, : min(radius, width)].sum()
        for x in range(width):
            for k in range(_N_SUMS):
                if x + radius < width:
                    sums[k] += columns[k, x + radius]
                if x - radius - 1 >= 0:
                    sums[k] -= columns[k, x - radius - 1]
            step[row, x] = np.nan
            sigma[row, x] = np.nan
            correlation[row, x] = 0.0
            refined[row, x] = sums[_O] / sums[_GG] if sums[_GG] > 1e-3 else 0.0
            if np.isnan(support[row, x]) or sums[_N] < min_filled * size * size:
                continue
            if solve_window(sums, answer):
                step[row, x] = answer[0]
                refined[row, x] += min(max(answer[0], -_LARGEST_STEP_PX), _LARGEST_STEP_PX)
                sigma[row, x] = answer[1]
                correlation[row, x] = answer[2]
