"""Compiled local least squares: one Gauss-Newton step of the disparity of every window of a row."""

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
from navapp.stereo.subpixel.window_sum_kernels import (
    N_SOLVED,
    N_SUMS,
    SUM_G,
    SUM_GG,
    SUM_L,
    SUM_LG,
    SUM_LL,
    SUM_LR,
    SUM_O,
    SUM_OO,
    SUM_R,
    SUM_RG,
    SUM_RR,
    Planes,
)

# Of a row of windows: 1 where there is support; step, correlation (at first without its divisor),
# new offset. The last three await their square roots.
_SUPPORTED, SOLVED_STEP, SOLVED_CORRELATION, SOLVED_NEW, SOLVED_VARIANCE, _LL_RR, SOLVED_SPREAD = (
    range(N_SOLVED)
)
_LARGEST_STEP_PX = np.float32(0.5)
_NOTHING = np.float32(0.0)


@njit(cache=True, nogil=True)
def thin_out(planes: Planes, support: NDArray[np.float32], stride: int) -> None:
    """Only every `stride`-th window of the sums, and whether it has support.

    Args:
        planes: sums and solved in place.
        support: (w,) disparity px of the row.
        stride: px.
    """
    supported = planes.solved.reshape(N_SOLVED, -1)[_SUPPORTED]
    count = (support.shape[0] + stride - 1) // stride
    for x in range(count):
        supported[x] = not np.isnan(support[x * stride])
    if stride > 1:
        for plane in planes.sums.reshape(N_SUMS, -1):
            for x in range(count):
                plane[x] = plane[x * stride]


@njit(cache=True, nogil=True, error_model="numpy")
def solve_windows(planes: Planes, span: tuple[int, int], least: np.float32) -> None:
    """Gain and disparity step of each window.

    Minimises sum (l - b (r - g e))^2 over the gain b and the step e, all mean-free: a difference in
    brightness or contrast between the cameras does not move the answer.

    Args:
        planes: sums are read; solved in place.
        span: first window, a multiple of the lanes, and after the last.
        least: number of pixels that a window needs.
    """
    pitch, sums, solved = planes.pitch, planes.sums, planes.solved
    zero, one, unknown = spread(_NOTHING), spread(np.float32(1.0)), spread(np.float32(np.nan))
    for x in range(span[0], span[1], FLOAT_LANES):
        n, s_l, s_r = load(sums, x), load(sums, SUM_L * pitch + x), load(sums, SUM_R * pitch + x)
        s_g, weight = load(sums, SUM_G * pitch + x), load(sums, SUM_GG * pitch + x)
        per_n = one / larger(n, one)
        mean_l, mean_r = s_l * per_n, s_r * per_n
        ll = load(sums, SUM_LL * pitch + x) - mean_l * s_l
        rr = load(sums, SUM_RR * pitch + x) - mean_r * s_r
        gg = weight - s_g * per_n * s_g
        lr = load(sums, SUM_LR * pitch + x) - mean_l * s_r
        lg = load(sums, SUM_LG * pitch + x) - mean_l * s_g
        rg = load(sums, SUM_RG * pitch + x) - mean_r * s_g
        determinant = rr * gg - rg * rg
        per_determinant = one / determinant
        gain = (lr * gg - lg * rg) * per_determinant
        gain_step = (lr * rg - lg * rr) * per_determinant
        thousandth = spread(np.float32(1e-3))
        answers = load(solved, _SUPPORTED * pitch + x)
        answers = where_positive(spread(least) - n, zero, answers)
        answers = where_positive(thousandth * n - smaller(ll, rr), zero, answers)
        answers = where_positive(spread(np.float32(1e-4)) * n - gg, zero, answers)
        answers = where_positive(thousandth * rr * gg - determinant, zero, answers)
        # What is not a number is not positive: it does not answer.
        answers = where_positive(gain - spread(np.float32(0.2)), answers, zero)
        answers = where_positive(spread(np.float32(5.0)) - gain, answers, zero)
        step = gain_step / gain
        residual = larger(ll - gain * lr + gain_step * lg, zero)
        freedom = larger(n - spread(np.float32(3.0)), one)
        per_weight = one / weight
        mean = load(sums, SUM_O * pitch + x) * per_weight
        rough = load(sums, SUM_OO * pitch + x) * per_weight - mean * mean
        mean = where_positive(weight - thousandth, mean, zero)
        most = spread(_LARGEST_STEP_PX)
        bounded = smaller(larger(step, zero - most), most)
        variance = residual * rr * per_determinant / (freedom * gain * gain)
        store(solved, SOLVED_NEW * pitch + x, mean + where_positive(answers, bounded, zero))
        store(solved, SOLVED_STEP * pitch + x, where_positive(answers, step, unknown))
        store(solved, SOLVED_VARIANCE * pitch + x, where_positive(answers, variance, unknown))
        store(
            solved, SOLVED_SPREAD * pitch + x, where_positive(answers, larger(rough, zero), unknown)
        )
        store(solved, SOLVED_CORRELATION * pitch + x, where_positive(answers, lr, zero))
        store(solved, _LL_RR * pitch + x, where_positive(answers, ll * rr, one))


@njit(cache=True, nogil=True, error_model="numpy")
def take_roots(planes: Planes, span: tuple[int, int]) -> None:
    """Square roots of what was solved: loops over one array, so that the compiler makes vectors."""
    first, after = span
    solved = planes.solved.reshape(N_SOLVED, -1)
    for index in (SOLVED_VARIANCE, SOLVED_SPREAD, _LL_RR):
        plane = solved[index]
        for x in range(first, after):
            plane[x] = np.sqrt(plane[x])
    correlation, divisor = solved[SOLVED_CORRELATION], solved[_LL_RR]
    for x in range(first, after):
        correlation[x] /= divisor[x]
