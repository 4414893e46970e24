"""Compiled sum of gradient magnitude differences over a window, for both views at once.

Magnitudes are whole numbers of 1/16 grey, so running sums do not drift.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

_MOST = np.int32(2147483647)


@njit(cache=True, nogil=True)
def add_row(
    left: NDArray[np.int32],
    right: NDArray[np.int32],
    y: int,
    sign: int,
    columns: NDArray[np.int32],
) -> None:
    """Add (sign 1) or take away (sign -1) a row of |m_l - m_r| from the columns' sums.

    Args:
        left: (H, w) magnitudes.
        right: (H, w + n - 1) magnitudes, mirrored, so that the loop runs along memory: the partner
            of left column x at disparity number k is column w - 1 - x + k.
        y: row.
        sign: 1 or -1.
        columns: (w, n) in place.
    """
    width, n = columns.shape
    for x in range(width):
        value = left[y, x]
        partners = right[y, width - 1 - x : width - 1 - x + n]
        sums = columns[x]
        for k in range(n):
            sums[k] += np.int32(sign * abs(value - partners[k]))


@njit(cache=True, nogil=True)
def slide_window(columns: NDArray[np.int32], x: int, sign: int, window: NDArray[np.int32]) -> None:
    """Add (sign 1) or take away (sign -1) a column's sums from the window's, (n,) in place."""
    for k in range(window.shape[0]):
        window[k] += np.int32(sign * columns[x, k])


@njit(cache=True, nogil=True)
def choose_window(
    window: NDArray[np.int32],
    partners: tuple[int, int, int],
    x: int,
    best: NDArray[np.int32],
    choice: NDArray[np.int32],
) -> int:
    """The left winner of one pixel, -1 without a partner; the right winners so far are updated.

    Args:
        window: (n,) sums.
        partners: mirrored right column of left column 0 at the first disparity; first mirrored
            column inside the picture; the one after the last.
        x: left column.
        best: (W,) in place, mirrored, lowest sum so far.
        choice: (W,) in place, mirrored, its disparity's number.
    """
    base = partners[0] - x
    first, end = max(0, partners[1] - base), min(window.shape[0], partners[2] - base)
    if first >= end:
        return -1
    sums = window[first:end]
    best_part, choice_part = best[base + first : base + end], choice[base + first : base + end]
    lowest = _MOST
    for k in range(sums.shape[0]):
        lowest = min(lowest, sums[k])
        # Written every time: without a branch the loop is compiled to vectors.
        is_better = sums[k] < best_part[k]
        choice_part[k] = np.int32(first + k) if is_better else choice_part[k]
        best_part[k] = min(best_part[k], sums[k])
    winner = 0
    while sums[winner] != lowest:
        winner += 1
    return first + winner


@njit(cache=True, nogil=True)
def match_rows(
    left: NDArray[np.int32],
    right: NDArray[np.int32],
    inside: tuple[int, int],
    rows: tuple[int, int],
    left_choice: NDArray[np.int32],
    right_choice: NDArray[np.int32],
) -> None:
    """Winner takes all in both views for some rows.

    The right view's sum for pixel u at disparity d is that of left pixel u + d.

    Args:
        left: (h + 2 r, w + 2 r) magnitudes with a margin of the window's radius.
        right: (h + 2 r, w + 2 r + n - 1) of all partners, mirrored.
        inside: first mirrored column of `right_choice` inside the picture, and the one after the
            last.
        rows: first, and after the last, to fill.
        left_choice: (h, w) in place: number of the best disparity, -1 without a partner.
        right_choice: (h, w + n - 1) in place, mirrored; its column u is `right`'s column u + r.
    """
    width = left_choice.shape[1]
    radius = (left.shape[1] - width) // 2
    n = right.shape[1] - left.shape[1] + 1
    columns = np.zeros((left.shape[1], n), dtype=np.int32)
    window = np.empty(n, dtype=np.int32)
    best = np.empty(right_choice.shape[1], dtype=np.int32)
    partners = (width - 1, inside[0], inside[1])
    for y in range(rows[0], rows[0] + 2 * radius):
        add_row(left, right, y, 1, columns)
    for y in range(rows[0], rows[1]):
        add_row(left, right, y + 2 * radius, 1, columns)
        best[:] = _MOST
        right_choice[y] = -1
        window[:] = 0
        for x in range(2 * radius):
            slide_window(columns, x, 1, window)
        for x in range(width):
            slide_window(columns, x + 2 * radius, 1, window)
            left_choice[y, x] = choose_window(window, partners, x, best, right_choice[y])
            slide_window(columns, x, -1, window)
        add_row(left, right, y, -1, columns)
