"""Compiled lines with soft edges, told apart by what is seen in front of them."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# A line is followed in steps of so many px; each is on top, beneath or hidden as a whole.
_STEP_PX = 1.5
_FARTHEST_PX = 20_000.0


class Ground(NamedTuple):
    """What is known of the depth in a box of the picture."""

    x: int
    y: int
    weight: NDArray[np.float32]  # (h, w) 0 to 1, of guides on the bone
    nearest_mm: NDArray[np.float32]  # (h, w) of bone and what was matched, NaN where unknown
    skin_mm: np.float32  # further behind that a point is beneath
    beneath: np.float32  # weight of what lies beneath
    beyond: np.float32  # weight outside of the box


class Pen(NamedTuple):
    """How a line is drawn."""

    half_px: np.float32  # half of its width
    rim_px: np.float32  # width of a dark rim on either side, where the line is on top
    dash_px: np.float32
    gap_px: np.float32


@njit(cache=True, nogil=True)
def trace_line(
    pixels: NDArray[np.float64],
    depth_mm: NDArray[np.float64],
    ground: Ground,
    pen: Pen,
    line: NDArray[np.float32],
    rim: NDArray[np.float32],
    touched: NDArray[np.int32],
) -> tuple[int, int]:
    """How much of each pixel a line covers, and its rim; how many pixels of both are touched.

    Dashed where it lies beneath something or where that is not known, left out where it is hidden.

    Args:
        pixels: (N, 2) of its points; NaN where they are not seen.
        depth_mm: (N,).
        ground: what is seen.
        pen: of the line.
        line: (H, W) of the picture, in place, 0 to 1; the larger share stays.
        rim: (H, W) in place.
        touched: (2, n) in place, the pixels of the line and of the rim, counted row by row; those
            beyond n are left out.
    """
    period, along = pen.dash_px + pen.gap_px, 0.0
    n_line, n_rim = 0, 0
    for k in range(len(pixels) - 1):
        u0, v0, u1, v1 = pixels[k, 0], pixels[k, 1], pixels[k + 1, 0], pixels[k + 1, 1]
        # A comparison with NaN is False.
        if not (abs(u0) < _FARTHEST_PX and abs(v0) < _FARTHEST_PX):
            continue
        if not (abs(u1) < _FARTHEST_PX and abs(v1) < _FARTHEST_PX):
            continue
        length = np.hypot(u1 - u0, v1 - v0)
        n = int(length / _STEP_PX) + 1
        for step in range(n):
            a, b = step / n, (step + 1) / n
            middle = 0.5 * (a + b)
            u, v = u0 + middle * (u1 - u0), v0 + middle * (v1 - v0)
            z = depth_mm[k] + middle * (depth_mm[k + 1] - depth_mm[k])
            weight = weigh(u, v, z, ground)
            is_beneath = weight <= ground.beneath
            along += length / n
            if weight < 0.5 * ground.beneath or (is_beneath and along % period > pen.dash_px):
                continue
            ends = (
                u0 + a * (u1 - u0), v0 + a * (v1 - v0), u0 + b * (u1 - u0), v0 + b * (v1 - v0)
            )  # fmt: skip
            n_line = _cover(ends, pen.half_px, line, touched[0], n_line)
            if pen.rim_px > 0.0 and not is_beneath:
                n_rim = _cover(ends, pen.half_px + pen.rim_px, rim, touched[1], n_rim)
    return n_line, n_rim


@njit(cache=True, nogil=True)
def blend_touched(
    image: NDArray[np.uint8],
    share: NDArray[np.float32],
    touched: NDArray[np.int32],
    colour: tuple[int, int, int],
) -> None:
    """Blend one colour into some pixels, and set their share back to 0.

    Args:
        image: (H, W, 3) in place.
        share: (H, W) in place, of the colour, 0 to 1.
        touched: (n,) the pixels, counted row by row.
        colour: of the image's channels.
    """
    width = share.shape[1]
    for place in touched:
        row, column = place // width, place % width
        part = share[row, column]
        share[row, column] = np.float32(0.0)
        for k in range(3):
            before = np.float32(image[row, column, k])
            after = before + part * (np.float32(colour[k]) - before)
            image[row, column, k] = np.uint8(after + np.float32(0.5))


@njit(cache=True, nogil=True)
def weigh(u: float, v: float, z: float, ground: Ground) -> np.float32:
    """How strongly a point of a guide is drawn at a place and depth: 0 hidden, 1 on top."""
    row, column = int(np.floor(v + 0.5)) - ground.y, int(np.floor(u + 0.5)) - ground.x
    if not (0 <= row < ground.weight.shape[0] and 0 <= column < ground.weight.shape[1]):
        return ground.beyond
    weight = ground.weight[row, column]
    # A comparison with an unknown depth is False.
    if z > ground.nearest_mm[row, column] + ground.skin_mm:
        return np.float32(min(weight, ground.beneath))
    return np.float32(weight)


@njit(cache=True, nogil=True)
def _cover(
    ends: tuple[float, float, float, float],
    half_px: float,
    share: NDArray[np.float32],
    touched: NDArray[np.int32],
    n: int,
) -> int:
    """Pixels of a stroke with round ends; their edge is one pixel wide. How many were touched."""
    u0, v0, u1, v1 = ends
    reach = half_px + 0.5
    du, dv = u1 - u0, v1 - v0
    squared = du * du + dv * dv
    first_row, last_row = int(np.ceil(min(v0, v1) - reach)), int(np.floor(max(v0, v1) + reach))
    first, last = int(np.ceil(min(u0, u1) - reach)), int(np.floor(max(u0, u1) + reach))
    for row in range(max(0, first_row), min(last_row + 1, share.shape[0])):
        for column in range(max(0, first), min(last + 1, share.shape[1])):
            along = 0.0
            if squared > 0.0:
                along = ((column - u0) * du + (row - v0) * dv) / squared
                along = min(max(along, 0.0), 1.0)
            off = np.hypot(column - u0 - along * du, row - v0 - along * dv)
            covered = np.float32(min(max(reach - off, 0.0), 1.0))
            if covered > share[row, column]:
                if share[row, column] == 0.0:
                    if n == len(touched):
                        continue
                    touched[n] = row * share.shape[1] + column
                    n += 1
                share[row, column] = covered
    return n
