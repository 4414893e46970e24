"""Compiled refinement of disparities, row by row: windows are summed, solved and handed out."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.lane_kernels import FLOAT_LANES
from navapp.stereo.subpixel.window_kernels import (
    N_SOLVED,
    SOLVED_CORRELATION,
    SOLVED_NEW,
    SOLVED_SPREAD,
    SOLVED_STEP,
    SOLVED_VARIANCE,
    Planes,
    add_up,
    close_block,
    enter_row,
    make_planes,
    sample_row,
    solve_windows,
    take_roots,
    thin_out,
)

# What is known of a window after a step.
STEP, SIGMA, CORRELATION, ROUGHNESS = range(4)
N_QUALITIES = 4
_NOTHING = np.float32(0.0)


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
    solved = planes.solved.reshape(N_SOLVED, -1)
    step, sigma, new = solved[SOLVED_STEP], solved[SOLVED_VARIANCE], solved[SOLVED_NEW]
    correlation, roughness = solved[SOLVED_CORRELATION], solved[SOLVED_SPREAD]
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
def find_supported_spans(
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
        spans: as `find_supported_spans` makes them.
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
        max(low - radius, 0) // FLOAT_LANES * FLOAT_LANES,
        min(-(-(high + radius) // FLOAT_LANES) * FLOAT_LANES, pitch),
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
    spans = find_supported_spans(support, stride, rows)
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
                    asked = (
                        asked[0] // stride // FLOAT_LANES * FLOAT_LANES,
                        -(-asked[1] // stride),
                    )
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
