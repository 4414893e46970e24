"""Compiled local least squares: one Gauss-Newton step of every pixel's disparity.

Values lie in planes, one kind after the other, so that eight neighbours are added and solved at
once. Sums never take anything away again: float32 keeps their digits however many rows there are.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.float_lane_kernels import (
    LANES,
    larger,
    load,
    smaller,
    spread,
    store,
    where_positive,
)

# Window sums: number of pixels; left, right, gradient; their products; gradient^2 times the
# offset and its square.
_N, _L, _R, _G, _LL, _RR, _GG, _LR, _LG, _RG, _O, _OO = range(12)
N_SUMS = 12
# What is known of a window after a step.
STEP, SIGMA, CORRELATION, ROUGHNESS = range(4)
N_QUALITIES = 4
# Of one row: left, offset, whether the partner is known, four neighbours there and the place
# between the middle ones.
_LEFT, _OFFSET, _KNOWN, _P0, _P1, _P2, _P3, _T = range(8)
_N_SAMPLES = 8
# Of a row of windows: 1 where there is support; step, correlation (at first without its divisor),
# new offset. The last three await their square roots.
_SUPPORTED, _STEP, _CORRELATION, _NEW, _VARIANCE, _LL_RR, _SPREAD = range(7)
_N_SOLVED = 7
_LARGEST_STEP_PX = np.float32(0.5)
_NOTHING = np.float32(0.0)


class Planes(NamedTuple):
    """Room to work in.

    Attributes:
        pitch: elements from plane to plane, at least the width; multiple of the lanes.
        wide_pitch: the same in `columns`, which have a margin of one radius on either side.
        samples: (8 pitch,) what is seen of one row.
        ring: (2 radius + 1, 12 pitch) flat; the terms of the rows of this block so far, then sums
            of the rows of the block before, from each to its last.
        block: (12 pitch,) sums of the rows of this block so far.
        columns: (12 wide_pitch,) sums over the window's rows.
        sums: (12 pitch,) sums over windows.
        solved: (7 pitch,) what follows from them.
    """

    pitch: int
    wide_pitch: int
    samples: NDArray[np.float32]
    ring: NDArray[np.float32]
    block: NDArray[np.float32]
    columns: NDArray[np.float32]
    sums: NDArray[np.float32]
    solved: NDArray[np.float32]


@njit(cache=True, nogil=True)
def make_planes(width: int, radius: int) -> Planes:
    """Room for rows of a width, empty."""
    pitch = -(-width // LANES) * LANES
    wide_pitch = pitch + -(-2 * radius // LANES) * LANES
    return Planes(
        pitch,
        wide_pitch,
        np.zeros(_N_SAMPLES * pitch, dtype=np.float32),
        np.zeros((2 * radius + 1) * N_SUMS * pitch, dtype=np.float32),
        np.zeros(N_SUMS * pitch, dtype=np.float32),
        np.zeros(N_SUMS * wide_pitch, dtype=np.float32),
        np.zeros(N_SUMS * pitch, dtype=np.float32),
        np.zeros(_N_SOLVED * pitch, dtype=np.float32),
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
    for x in range(span[0], span[1], LANES):
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
        _enter(planes, place, _N, x, known)
        _enter(planes, place, _L, x, value)
        _enter(planes, place, _R, x, r)
        _enter(planes, place, _G, x, g)
        _enter(planes, place, _LL, x, value * value)
        _enter(planes, place, _RR, x, r * r)
        _enter(planes, place, _GG, x, gg)
        _enter(planes, place, _LR, x, value * r)
        _enter(planes, place, _LG, x, value * g)
        _enter(planes, place, _RG, x, r * g)
        _enter(planes, place, _O, x, gg * o)
        _enter(planes, place, _OO, x, gg * o * o)


@njit(cache=True, nogil=True)
def _enter(planes: Planes, place: int, term: int, x: int, value: Any) -> None:
    at = term * planes.pitch + x
    store(planes.ring, place * N_SUMS * planes.pitch + at, value)
    store(planes.block, at, load(planes.block, at) + value)


@njit(cache=True, nogil=True)
def close_block(planes: Planes, size: int, span: tuple[int, int]) -> None:
    """The ring is full: from terms to sums of each row to the last one; a new block begins.

    Args:
        planes: ring and block in place.
        size: rows of the ring.
        span: first pixel that was entered, and after the last.
    """
    pitch, length = planes.pitch, N_SUMS * planes.pitch
    for place in range(size - 2, -1, -1):
        for term in range(N_SUMS):
            begin = place * length + term * pitch
            for at in range(begin + span[0], begin + span[1], LANES):
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
    margin = -(-radius // LANES) * LANES
    low, high = max(span[0] - margin, 0), min(span[1] + margin, planes.pitch)
    pitch, wide, columns = planes.pitch, planes.wide_pitch, planes.columns
    # The older rows of the windows end the block before, unless the block is all of them.
    older = (place + 1) * N_SUMS * pitch
    for term in range(N_SUMS):
        middle = term * (wide - pitch) + radius
        for at in range(term * pitch + low, term * pitch + high, LANES):
            value = load(planes.block, at)
            if place < 2 * radius:
                value = value + load(planes.ring, older + at)
            store(columns, middle + at, value)
        for x in range(span[0], span[1], LANES):
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
    supported = planes.solved.reshape(_N_SOLVED, -1)[_SUPPORTED]
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
    for x in range(span[0], span[1], LANES):
        n, s_l, s_r = load(sums, x), load(sums, _L * pitch + x), load(sums, _R * pitch + x)
        s_g, weight = load(sums, _G * pitch + x), load(sums, _GG * pitch + x)
        per_n = one / larger(n, one)
        mean_l, mean_r = s_l * per_n, s_r * per_n
        ll = load(sums, _LL * pitch + x) - mean_l * s_l
        rr = load(sums, _RR * pitch + x) - mean_r * s_r
        gg = weight - s_g * per_n * s_g
        lr = load(sums, _LR * pitch + x) - mean_l * s_r
        lg = load(sums, _LG * pitch + x) - mean_l * s_g
        rg = load(sums, _RG * pitch + x) - mean_r * s_g
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
        mean = load(sums, _O * pitch + x) * per_weight
        rough = load(sums, _OO * pitch + x) * per_weight - mean * mean
        mean = where_positive(weight - thousandth, mean, zero)
        most = spread(_LARGEST_STEP_PX)
        bounded = smaller(larger(step, zero - most), most)
        variance = residual * rr * per_determinant / (freedom * gain * gain)
        store(solved, _NEW * pitch + x, mean + where_positive(answers, bounded, zero))
        store(solved, _STEP * pitch + x, where_positive(answers, step, unknown))
        store(solved, _VARIANCE * pitch + x, where_positive(answers, variance, unknown))
        store(solved, _SPREAD * pitch + x, where_positive(answers, larger(rough, zero), unknown))
        store(solved, _CORRELATION * pitch + x, where_positive(answers, lr, zero))
        store(solved, _LL_RR * pitch + x, where_positive(answers, ll * rr, one))


@njit(cache=True, nogil=True, error_model="numpy")
def take_roots(planes: Planes, span: tuple[int, int]) -> None:
    """Square roots of what was solved: loops over one array, so that the compiler makes vectors."""
    first, after = span
    solved = planes.solved.reshape(_N_SOLVED, -1)
    for index in (_VARIANCE, _SPREAD, _LL_RR):
        plane = solved[index]
        for x in range(first, after):
            plane[x] = np.sqrt(plane[x])
    correlation, divisor = solved[_CORRELATION], solved[_LL_RR]
    for x in range(first, after):
        correlation[x] /= divisor[x]


@njit(cache=True, nogil=True)
def tell_row(
    planes: Planes,
    stride: int,
    span: tuple[int, int],
    refined: NDArray[np.float32],
    quality: NDArray[np.float32],
) -> None:
    """Hand out what was solved.

    Args:
        planes: solved is read.
        stride: px from window to window.
        span: first window that was solved, and after the last; the others cannot tell.
        refined: (w,) in place, new offset px; of the `stride` pixels from each window on.
        quality: (w / stride, 4) in place.
    """
    solved = planes.solved.reshape(_N_SOLVED, -1)
    step, sigma, new = solved[_STEP], solved[_VARIANCE], solved[_NEW]
    correlation, roughness = solved[_CORRELATION], solved[_SPREAD]
    told, width = quality.ravel(), refined.shape[0]
    first, after = span[0], min(span[1], quality.shape[0])
    quality[:first], quality[after:] = np.float32(np.nan), np.float32(np.nan)
    quality[:first, CORRELATION], quality[after:, CORRELATION] = _NOTHING, _NOTHING
    for x in range(first, after):
        told[N_QUALITIES * x + STEP] = step[x]
        told[N_QUALITIES * x + SIGMA] = sigma[x]
        told[N_QUALITIES * x + CORRELATION] = correlation[x]
        told[N_QUALITIES * x + ROUGHNESS] = roughness[x]
    refined[: first * stride], refined[after * stride :] = _NOTHING, _NOTHING
    for phase in range(stride):
        for x in range(first, min(after, (width - phase + stride - 1) // stride)):
            refined[x * stride + phase] = new[x]


@njit(cache=True, nogil=True)
def supported_spans(
    support: NDArray[np.float32], stride: int, rows: tuple[int, int]
) -> NDArray[np.int32]:
    """Columns of the windows of some rows that stand for a supported pixel.

    Args:
        support: (h, w) disparity px, NaN without.
        stride: px; a window stands for so many pixels each way from its own on.
        rows: first, and after the last.

    Returns:
        (n, 2) first column, and after the last; 0 and 0 without any.
    """
    height, width = support.shape
    spans = np.zeros((rows[1] - rows[0], 2), dtype=np.int32)
    for y in range(rows[0], rows[1]):
        if y % stride:
            continue
        low, high = width, 0
        for row in range(y, min(y + stride, height)):
            x = 0
            while x < low and np.isnan(support[row, x]):
                x += 1
            low, x = x, width
            while x > high and np.isnan(support[row, x - 1]):
                x -= 1
            high = x
        if low < high:
            spans[y - rows[0], 0], spans[y - rows[0], 1] = max(low - stride + 1, 0), high
    return spans


@njit(cache=True, nogil=True)
def joint_span(
    spans: NDArray[np.int32], rows: tuple[int, int], radius: int, pitch: int
) -> tuple[int, int]:
    """The columns that the windows of some rows reach, in whole lanes; of no rows, none.

    Args:
        spans: as `supported_spans` makes them.
        rows: first, and after the last, of the spans.
        radius: px of the windows.
        pitch: no column lies beyond.
    """
    low, high = pitch, 0
    for row in range(max(rows[0], 0), min(rows[1], spans.shape[0])):
        if spans[row, 0] < spans[row, 1]:
            low, high = min(low, spans[row, 0]), max(high, spans[row, 1])
    if low >= high:
        return 0, 0
    return (
        max(low - radius, 0) // LANES * LANES,
        min(-(-(high + radius) // LANES) * LANES, pitch),
    )


@njit(cache=True, nogil=True)
def refine_rows(
    left: NDArray[np.float32],
    right: NDArray[np.float32],
    support: NDArray[np.float32],
    offset: NDArray[np.float32],
    right_column: int,
    window: tuple[int, int, float],
    rows: tuple[int, int],
    refined: NDArray[np.float32],
    quality: NDArray[np.float32],
) -> None:
    """One step for some rows (rows around them are read).

    The step is what the window as a whole lacks, so it is added to the window's mean offset, each
    pixel counted by its squared gradient as in the step itself. Added to the pixel's own offset,
    what one pixel has too much would never be corrected, and grows.

    Args:
        left: (h, w), centred grey values of the box.
        right: (h, W) of the same rows.
        support: (h, w) disparity px; NaN where there is none.
        offset: (h, w) px now, added to the support.
        right_column: column of the box's first pixel in `right`.
        window: radius px; stride px of the windows that are solved; least number of pixels.
        rows: first, and after the last; the first is a multiple of the stride.
        refined: (h, w) in place, the new offset px; the window's mean where it cannot tell, and
            anything where there is no support. With a stride, what one window says stands for the
            pixels up to the next.
        quality: (h / stride, w / stride, 4) in place, of the windows that are solved: step px (NaN
            where the window cannot tell), sigma px, correlation, roughness px.
    """
    height, width = left.shape
    radius, stride, least = window
    first, after = rows
    size = 2 * radius + 1
    planes = make_planes(width, radius)
    spans = supported_spans(support, stride, rows)
    entered_low, entered_high = planes.pitch, 0
    for y in range(first - radius, after + radius):
        place = (y - first + radius) % size
        # All that some window asks for; what lies beside it is not read.
        span = joint_span(spans, (y - radius - first, y + radius + 1 - first), radius, planes.pitch)
        if 0 <= y < height:
            sample_row(left[y], right[y], support[y], offset[y], right_column, span, planes.samples)
        else:
            planes.samples[:] = np.float32(0.0)
        enter_row(planes, place, span)
        if span[0] < span[1]:
            entered_low, entered_high = min(entered_low, span[0]), max(entered_high, span[1])
        row = y - radius
        if row >= first:
            if row % stride == 0:
                asked = joint_span(spans, (row - first, row - first + 1), 0, planes.pitch)
                add_up(planes, place, radius, asked)
                thin_out(planes, support[row], stride)
                if stride > 1:
                    asked = (asked[0] // stride // LANES * LANES, -(-asked[1] // stride))
                solve_windows(planes, asked, np.float32(least))
                take_roots(planes, asked)
                tell_row(planes, stride, asked, refined[row], quality[row // stride])
            else:
                refined[row] = refined[row - 1]
        if place == size - 1:
            close_block(planes, size, (entered_low, entered_high))
            entered_low, entered_high = planes.pitch, 0


@njit(cache=True, nogil=True)
def accept_rows(
    support: NDArray[np.float32],
    offset: NDArray[np.float32],
    quality: NDArray[np.float32],
    limits: tuple[float, float, float, float],
    systematic_px: float,
    rows: tuple[int, int],
    disparity: NDArray[np.float32],
    sigma: NDArray[np.float32],
    is_matched: NDArray[np.uint8],
) -> None:
    """Disparity and claimed sigma of the windows that are good enough; NaN elsewhere.

    Args:
        support: (h, w) disparity px.
        offset: (h, w) px, added to it.
        quality: (h, w, 4) as `refine_rows` leaves it.
        limits: largest step px, largest sigma px, least correlation, largest roughness px.
        systematic_px: added to sigma, squared.
        rows: first, and after the last.
        disparity: (h, w) in place.
        sigma: (h, w) in place.
        is_matched: (h, w) in place, 1 or 0.
    """
    step, most_sigma, least_correlation, most_rough = limits
    unknown, added = np.float32(np.nan), np.float32(systematic_px**2)
    # One array a loop: the compiler sees that nothing overlaps, and takes several pixels at once.
    for y in range(rows[0], rows[1]):
        said, row_sigma, row_disparity = quality[y].ravel(), sigma[y], disparity[y]
        row_support, row_offset, row_matched = support[y], offset[y], is_matched[y]
        for x in range(row_sigma.shape[0]):
            one = said[N_QUALITIES * x + SIGMA]
            # Every comparison with NaN is false.
            accepts = (
                (abs(said[N_QUALITIES * x + STEP]) <= step)
                & (one <= most_sigma)
                & (said[N_QUALITIES * x + CORRELATION] >= least_correlation)
                & (said[N_QUALITIES * x + ROUGHNESS] <= most_rough)
            )
            total = np.sqrt(one * one + added)
            row_sigma[x] = total if accepts else unknown
        for x in range(row_sigma.shape[0]):
            found = row_support[x] + row_offset[x]
            row_disparity[x] = unknown if np.isnan(row_sigma[x]) else found
        for x in range(row_sigma.shape[0]):
            row_matched[x] = not np.isnan(row_sigma[x])
