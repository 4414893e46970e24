"""Compiled search for what the right eye sees of a rendered left view, and for its outlines."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Chosen. Neighbouring pixels whose disparities are further apart lie on two surfaces.
JUMP_PX = 1.5


@njit(cache=True, nogil=True)
def warp_depth(
    depth_mm: NDArray[np.float32], first_column: int, scale_px_mm: float,
    warped_mm: NDArray[np.float32], first_warped: int,
) -> None:  # fmt: skip
    """The left depth buffer as the right eye sees it; what only that eye sees is missing.

    Args:
        depth_mm: (h, w), NaN where nothing is.
        first_column: of the buffer in the left picture.
        scale_px_mm: disparity times depth.
        warped_mm: (h, w2) in place, filled with NaN.
        first_warped: column of its first pixel in the right picture.
    """
    height, width = depth_mm.shape
    last_column, shift_px = warped_mm.shape[1] - 1, np.float32(first_column - first_warped)
    for r in range(height):
        for c in range(width):
            z = depth_mm[r, c]
            if not z > np.float32(0.0):
                continue
            at = int(np.floor(np.float32(c) + shift_px - np.float32(scale_px_mm) / z))
            if 0 <= at <= last_column and not warped_mm[r, at] <= z:
                warped_mm[r, at] = z
            if -1 <= at < last_column and not warped_mm[r, at + 1] <= z:
                warped_mm[r, at + 1] = z


@njit(cache=True, nogil=True)
def mark_unclear(
    disparity_px: NDArray[np.float32], reach_px: int, is_unclear: NDArray[np.bool_]
) -> None:
    """Mark the pixels of a surface that the right eye does not see, and those near an outline.

    The lens and the interpolation mix what lies on the two sides of an outline: near to it, in
    either picture, a pixel does not show the surface alone.

    Args:
        disparity_px: (h, w) of what is rendered in the left picture, NaN beside it.
        reach_px: in the left picture, around the pixels on both sides of an outline; in the right
            one, columns from the left end of a surface on.
        is_unclear: (h, w) in place; others stay as they are.
    """
    height, width = disparity_px.shape
    is_hidden = np.empty(width, np.bool_)
    for y in range(height):
        for x in range(width):
            if _is_outline(disparity_px, y, x):
                rows = slice(max(y - reach_px, 0), y + reach_px + 1)
                is_unclear[rows, max(x - reach_px, 0) : x + reach_px + 1] = True
        _find_hidden(disparity_px[y], is_hidden)
        _mark_for_right_eye(disparity_px[y], is_hidden, reach_px, is_unclear[y])


@njit(cache=True, nogil=True, inline="always")
def _is_outline(disparity_px: NDArray[np.float32], y: int, x: int) -> bool:
    """Whether a neighbour of a pixel shows another surface, or none."""
    here = disparity_px[y, x]
    if np.isnan(here):
        return False
    for dy, dx in ((0, -1), (0, 1), (-1, 0), (1, 0)):
        v, u = y + dy, x + dx
        is_inside = 0 <= v < disparity_px.shape[0] and 0 <= u < disparity_px.shape[1]
        # Comparisons with NaN are false.
        if is_inside and not abs(disparity_px[v, u] - here) <= JUMP_PX:
            return True
    return False


@njit(cache=True, nogil=True)
def _find_hidden(row_px: NDArray[np.float32], is_hidden: NDArray[np.bool_]) -> None:
    """What the right eye does not see of a row (w,).

    It is hidden by what lies further right in the left picture and not in the right one. Behind a
    thin thing that is too much: the right eye sees again what lies on its other side.
    """
    first = np.inf
    for x in range(len(row_px) - 1, -1, -1):
        column = x - row_px[x]
        is_hidden[x] = column >= first
        if column < first:
            first = column


@njit(cache=True, nogil=True)
def _mark_for_right_eye(
    row_px: NDArray[np.float32],
    is_hidden: NDArray[np.bool_],
    reach_px: int,
    is_unclear: NDArray[np.bool_],
) -> None:
    """Mark what is hidden of a row (w,), and the left ends of surfaces as the right eye sees them.

    What it sees of a far surface just left of a near one is not marked: that gained nothing.
    """
    edge = -np.inf
    for x in range(len(row_px)):
        if is_hidden[x]:
            is_unclear[x] = True
            continue
        column = x - row_px[x]
        if x > 0 and (is_hidden[x - 1] or not abs(row_px[x] - row_px[x - 1]) <= JUMP_PX):
            edge = column
        if column - edge < reach_px:
            is_unclear[x] = True
