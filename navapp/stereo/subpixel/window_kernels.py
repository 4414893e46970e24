"""Compiled sums over the square windows of a row, and one Gauss-Newton step of their disparity.

Values lie in planes, one kind after the other, so that eight neighbours are added at once. Sums
never take anything away again: float32 keeps their digits however many rows there are.
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

# Window sums: number of pixels; left, right, gradient; their products; gradient^2 times the
# offset and its square.
_SUM_N, _SUM_L, _SUM_R, _SUM_G, _SUM_LL, _SUM_RR, _SUM_GG = range(7)
_SUM_LR, _SUM_LG, _SUM_RG, _SUM_O, _SUM_OO = range(7, 12)
_N_SUMS = 12
# Of one row: left, offset, whether the partner is known, four neighbours there and the place
# between the middle ones.
_LEFT, _OFFSET, _KNOWN, _P0, _P1, _P2, _P3, _T = range(8)
_N_SAMPLES = 8
N_SOLVED = 7
# Of a row of windows: 1 where there is support; step, correlation (at first without its divisor),
# new offset. The last three await their square roots.
_SUPPORTED, SOLVED_STEP, SOLVED_CORRELATION, SOLVED_NEW, SOLVED_VARIANCE, _LL_RR, SOLVED_SPREAD = (
    range(N_SOLVED)
)
_LARGEST_STEP_PX = np.float32(0.5)
_NOTHING = np.float32(0.0)


class Planes(NamedTuple):
    """Room to work in."""

    pitch: int  # elements from plane to plane, at least the width; multiple of the lanes
    wide_pitch: int  # the same in `columns`, which have a margin of one radius on either side
    samples: NDArray[np.float32]  # (8 pitch,) what is seen of one row
    # (2 radius + 1, 12 pitch) flat; the terms of the rows of this block so far, then sums of the
    # rows of the block before, from each to its last.
    ring: NDArray[np.float32]
    block: NDArray[np.float32]  # (12 pitch,) sums of the rows of this block so far
    columns: NDArray[np.float32]  # (12 wide_pitch,) sums over the window's rows
    sums: NDArray[np.float32]  # (12 pitch,) sums over windows
    solved: NDArray[np.float32]  # (7 pitch,) what follows from them


@njit(cache=True, nogil=True)
def make_planes(width: int, radius: int) -> Planes:
    """Room for rows of a width, empty."""
    pitch = -(-width // FLOAT_LANES) * FLOAT_LANES
    wide_pitch = pitch + -(-2 * radius // FLOAT_LANES) * FLOAT_LANES
    return Planes(
        pitch,
        wide_pitch,
        np.zeros(_N_SAMPLES * pitch, dtype=np.float32),
        np.zeros((2 * radius + 1) * _N_SUMS * pitch, dtype=np.float32),
        np.zeros(_N_SUMS * pitch, dtype=np.float32),
        np.zeros(_N_SUMS * wide_pitch, dtype=np.float32),
        np.zeros(_N_SUMS * pitch, dtype=np.float32),
        np.zeros(N_SOLVED * pitch, dtype=np.float32),
    )


@njit(cache=True, nogil=True)
def sample_row(
    left: NDArray[np.float32],
    right: NDArray[np.float32],
    support: NDArray[np.float32],
    offset: NDArray[np.float32],
    right_column: int,
    span: tuple[int, int],
    samples: NDArray[np.float32],
) -> None:
    """Neighbours in the right picture of where the disparity points, of one row.

    Args:
        left: (w,) grey values, centred.
        right: (W,) grey values, centred.
        support: (w,) disparity px, NaN where there is none.
        offset: (w,) px that is added to it.
        right_column: column of the left row's first pixel in the right row.
        span: first pixel, and after the last.
        samples: (8 pitch,) in place; the neighbours are 0 where they are unknown or outside.
    """
    planes = samples.reshape(_N_SAMPLES, -1)
    known, place = planes[_KNOWN], planes[_T]
    p0, p1, p2, p3 = planes[_P0], planes[_P1], planes[_P2], planes[_P3]
    first, after = span[0], min(span[1], left.shape[0])
    planes[_LEFT, first:after] = left[first:after]
    planes[_OFFSET, first:after] = offset[first:after]
    last = np.float32(right.shape[0] - 2)
    for x in range(first, after):
        u = np.float32(x + right_column) - support[x] - offset[x]
        # Also false for NaN.
        if u >= np.float32(1.0) and u < last:
            # An unsigned index is not looked at twice, for it cannot count from the end.
            i = np.uintp(int(u))
            p0[x], p1[x] = right[i - np.uintp(1)], right[i]
            p2[x], p3[x] = right[i + np.uintp(1)], right[i + np.uintp(2)]
            place[x] = u - np.float32(int(u))
            known[x] = np.float32(1.0)
        else:
            p0[x], p1[x], p2[x], p3[x] = _NOTHING, _NOTHING, _NOTHING, _NOTHING
            known[x] = _NOTHING


@njit(cache=True, nogil=True)
def enter_row(planes: Planes, place: int, span: tuple[int, int]) -> None:
    """Terms of the sampled row, into the ring and added to its block.

    Args:
        planes: samples are read; ring and block in place.
        place: of the row in the ring.
        span: first pixel, and after the last; multiples of the lanes.

    Catmull-Rom with a = -0.5: it reproduces a ramp, and its derivative is exact.
    """
    pitch, samples = planes.pitch, planes.samples
    half, two = spread(np.float32(0.5)), spread(np.float32(2.0))
    three_halves, five_halves = spread(np.float32(1.5)), spread(np.float32(2.5))
    three = spread(np.float32(3.0))
    for x in range(span[0], span[1], FLOAT_LANES):
        p0, p1 = load(samples, _P0 * pitch + x), load(samples, _P1 * pitch + x)
        p2, p3 = load(samples, _P2 * pitch + x), load(samples, _P3 * pitch + x)
        t = load(samples, _T * pitch + x)
        a = half * (p2 - p0)
        b = p0 - five_halves * p1 + two * p2 - half * p3
        c = half * (p3 - p0) + three_halves * (p1 - p2)
        r = p1 + t * (a + t * (b + t * c))
        g = a + t * (two * b + three * t * c)
        known, o = load(samples, _KNOWN * pitch + x), load(samples, _OFFSET * pitch + x)
        value = known * load(samples, _LEFT * pitch + x)
        gg = g * g
        _enter(planes, place, _SUM_N, x, known)
        _enter(planes, place, _SUM_L, x, value)
        _enter(planes, place, _SUM_R, x, r)
        _enter(planes, place, _SUM_G, x, g)
        _enter(planes, place, _SUM_LL, x, value * value)
        _enter(planes, place, _SUM_RR, x, r * r)
        _enter(planes, place, _SUM_GG, x, gg)
        _enter(planes, place, _SUM_LR, x, value * r)
        _enter(planes, place, _SUM_LG, x, value * g)
        _enter(planes, place, _SUM_RG, x, r * g)
        _enter(planes, place, _SUM_O, x, gg * o)
        _enter(planes, place, _SUM_OO, x, gg * o * o)


@njit(cache=True, nogil=True)
def _enter(planes: Planes, place: int, term: int, x: int, value: Any) -> None:
    at = term * planes.pitch + x
    store(planes.ring, place * _N_SUMS * planes.pitch + at, value)
    store(planes.block, at, load(planes.block, at) + value)


@njit(cache=True, nogil=True)
def close_block(planes: Planes, size: int, span: tuple[int, int]) -> None:
    """The ring is full: from terms to sums of each row to the last one; a new block begins.

    Args:
        planes: ring and block in place.
        size: rows of the ring.
        span: first pixel that was entered, and after the last.
    """
    pitch, length = planes.pitch, _N_SUMS * planes.pitch
    for place in range(size - 2, -1, -1):
        for term in range(_N_SUMS):
            begin = place * length + term * pitch
            for at in range(begin + span[0], begin + span[1], FLOAT_LANES):
                store(planes.ring, at, load(planes.ring, at) + load(planes.ring, at + length))
    planes.block[:] = np.float32(0.0)


@njit(cache=True, nogil=True)
def add_up(planes: Planes, place: int, radius: int, span: tuple[int, int]) -> None:
    """Sums over the windows around the pixels of a row.

    Args:
        planes: ring and block are read; columns and sums in place.
        place: in the ring, of the last row of the windows.
        radius: px.
        span: first pixel, and after the last; multiples of the lanes.
    """
    margin = -(-radius // FLOAT_LANES) * FLOAT_LANES
    low, high = max(span[0] - margin, 0), min(span[1] + margin, planes.pitch)
    pitch, wide, columns = planes.pitch, planes.wide_pitch, planes.columns
    # The older rows of the windows end the block before, unless the block is all of them.
    older = (place + 1) * _N_SUMS * pitch
    for term in range(_N_SUMS):
        middle = term * (wide - pitch) + radius
        for at in range(term * pitch + low, term * pitch + high, FLOAT_LANES):
            value = load(planes.block, at)
            if place < 2 * radius:
                value = value + load(planes.ring, older + at)
            store(columns, middle + at, value)
        for x in range(span[0], span[1], FLOAT_LANES):
            at = term * wide + x
            value = load(columns, at)
            for k in range(at + 1, at + 2 * radius + 1, 2):
                value = value + (load(columns, k) + load(columns, k + 1))
            store(planes.sums, term * pitch + x, value)


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
        for plane in planes.sums.reshape(_N_SUMS, -1):
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
        n, s_l, s_r = load(sums, x), load(sums, _SUM_L * pitch + x), load(sums, _SUM_R * pitch + x)
        s_g, weight = load(sums, _SUM_G * pitch + x), load(sums, _SUM_GG * pitch + x)
        per_n = one / larger(n, one)
        mean_l, mean_r = s_l * per_n, s_r * per_n
        ll = load(sums, _SUM_LL * pitch + x) - mean_l * s_l
        rr = load(sums, _SUM_RR * pitch + x) - mean_r * s_r
        gg = weight - s_g * per_n * s_g
        lr = load(sums, _SUM_LR * pitch + x) - mean_l * s_r
        lg = load(sums, _SUM_LG * pitch + x) - mean_l * s_g
        rg = load(sums, _SUM_RG * pitch + x) - mean_r * s_g
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
        mean = load(sums, _SUM_O * pitch + x) * per_weight
        rough = load(sums, _SUM_OO * pitch + x) * per_weight - mean * mean
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
