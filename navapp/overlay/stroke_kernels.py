"""Compiled lines with soft edges, told apart by what is seen in front of them."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# A line is followed in steps of so many px; each is on top, beneath or hidden as a whole.
_STEP_PX = 1.5
_FARTHEST_PX = 20_000.0
# Arms that are left shorter are not drawn at all.
_SHORTEST_PX = 2.5
_DASH_PX, _GAP_PX = 7.0, 5.0
_HIDDEN, _BENEATH, _ON_TOP = 0, 1, 2


class Ground(NamedTuple):
    """What is known of the depth in a box of the picture."""

    x: int
    y: int
    weight: NDArray[np.float32]  # (h, w) 0 to 1, of guides on the bone
    nearest_mm: NDArray[np.float32]  # (h, w) of bone and what was matched, NaN where unknown
    is_hidden: NDArray[np.bool_]  # (h, w) nothing may be drawn
    skin_mm: np.float32  # further behind that a point is beneath
    beneath: np.float32  # weight of what lies beneath
    beyond: np.float32  # weight outside of the box


class Room(NamedTuple):
    """Arrays that strokes are traced in; what is 0 before is 0 after."""

    line: NDArray[np.float32]  # (H, W) of the picture, 0: share of a pixel that a line covers
    rim: NDArray[np.float32]  # (H, W) 0: of its dark rim
    touched: NDArray[np.int32]  # (2, H * W) pixels of both
    place: NDArray[np.int32]  # (n,) pixels of all strokes, counted row by row
    share: NDArray[np.float32]  # (n,) 0 to 1
    number: NDArray[np.int32]  # (n,) of the stroke, or -1 of a rim


@njit(cache=True, nogil=True)
def trace_lines(
    pixels: NDArray[np.float64],
    depth_mm: NDArray[np.float64],
    firsts: NDArray[np.int64],
    is_whole: NDArray[np.bool_],
    half_px: NDArray[np.float64],
    rim_px: NDArray[np.float64],
    ground: Ground,
    room: Room,
) -> int:
    """How much of each pixel strokes cover, one stroke after the other; how many places there are.

    Dashed where it lies beneath something or where that is not known, left out where it is hidden.
    When the room is full, what comes after is left out: it was too small.

    Args:
        pixels: (N, 2) of the points of all strokes; NaN where they are not seen.
        depth_mm: (N,).
        firsts: (S + 1,) number of each stroke's first point, and N.
        is_whole: (S,) a stroke of arms from one point to another, judged at its first point for all
            of it; where an arm would be hidden, all of them end as near.
        half_px: (S,) half of the strokes' widths.
        rim_px: (S,) width of a dark rim on either side, where the line is on top.
        ground: what is seen.
        room: in place; the first so many places, shares and numbers are those to be blended.
    """
    n = 0
    for stroke in range(len(firsts) - 1):
        first, last = firsts[stroke], firsts[stroke + 1]
        weight, reach = np.float32(np.nan), 1.0
        if is_whole[stroke] and first < last:
            u, v = pixels[first, 0], pixels[first, 1]
            # A comparison with NaN is False.
            if not (abs(u) < _FARTHEST_PX and abs(v) < _FARTHEST_PX):
                continue
            weight = weigh(u, v, depth_mm[first], ground)
            reach = _find_reach(pixels[first:last], ground)
        whole = (weight, reach)
        n_line, n_rim = _trace_line(
            pixels[first:last], depth_mm[first:last], whole, ground, half_px[stroke],
            rim_px[stroke], room,
        )  # fmt: skip
        n = _move(room.rim, room.touched[1, :n_rim], -1, room, n)
        n = _move(room.line, room.touched[0, :n_line], stroke, room, n)
    return n


@njit(cache=True, nogil=True)
def blend_places(
    pixels: NDArray[np.uint8],
    place: NDArray[np.int32],
    share: NDArray[np.float32],
    number: NDArray[np.int32],
    colours: NDArray[np.float32],
) -> None:
    """Blend colours into some pixels, in their order.

    Args:
        pixels: (H * W, 3) of the picture, row by row, in place.
        place: (n,) numbers of pixels.
        share: (n,) of the colour, 0 to 1.
        number: (n,) row of `colours`, -1 for black.
        colours: (S, 3) of the image's channels.
    """
    for k in range(len(place)):
        for channel in range(3):
            before = np.float32(pixels[place[k], channel])
            colour = colours[number[k], channel] if number[k] >= 0 else np.float32(0.0)
            after = before + share[k] * (colour - before)
            pixels[place[k], channel] = np.uint8(after + np.float32(0.5))


@njit(cache=True, nogil=True)
def weigh(u: float, v: float, z: float, ground: Ground) -> np.float32:
    """How strongly a point at a place and depth of the picture is drawn, 0 to 1."""
    column, row = int(np.floor(u + 0.5)) - ground.x, int(np.floor(v + 0.5)) - ground.y
    height, width = ground.weight.shape
    if column < 0 or row < 0 or column >= width or row >= height:
        return ground.beyond
    weight: np.float32 = ground.weight[row, column]
    # A comparison with an unknown depth is False.
    if z > ground.nearest_mm[row, column] + ground.skin_mm:
        return min(weight, ground.beneath)
    return weight


@njit(cache=True, nogil=True)
def _find_reach(pixels: NDArray[np.float64], ground: Ground) -> float:
    """Share of the lines, from their first points, that is hidden on none; 0 when that is short."""
    reach, longest = 1.0, 0.0
    for k in range(len(pixels) - 1):
        u0, v0, u1, v1 = pixels[k, 0], pixels[k, 1], pixels[k + 1, 0], pixels[k + 1, 1]
        length = np.sqrt((u1 - u0) ** 2 + (v1 - v0) ** 2)
        # A comparison with NaN is False.
        if not length < _FARTHEST_PX:
            continue
        longest = max(longest, length)
        n = int(length) + 1
        for step in range(n + 1):
            share = step / n
            if share >= reach:
                break
            if _is_hidden(u0 + share * (u1 - u0), v0 + share * (v1 - v0), ground):
                reach = share
    return reach if reach * longest >= _SHORTEST_PX else 0.0


@njit(cache=True, nogil=True)
def _is_hidden(u: float, v: float, ground: Ground) -> bool:
    """Whether a place of the picture is hidden; beyond the ground where nothing is drawn there."""
    column, row = int(np.floor(u + 0.5)) - ground.x, int(np.floor(v + 0.5)) - ground.y
    height, width = ground.is_hidden.shape
    if column < 0 or row < 0 or column >= width or row >= height:
        return bool(ground.beyond <= 0.0)
    return bool(ground.is_hidden[row, column])


@njit(cache=True, nogil=True)
def _trace_line(
    pixels: NDArray[np.float64],
    depth_mm: NDArray[np.float64],
    whole: tuple[np.float32, float],
    ground: Ground,
    half_px: float,
    rim_px: float,
    room: Room,
) -> tuple[int, int]:
    """Cover a line and its rim in the room; how many pixels of both are touched.

    Weighed piece by piece, unless there is a weight of the whole (not NaN), which comes with the
    share of each line that is drawn; dashes begin with each line.
    """
    of_whole, reach = whole
    period, along = _DASH_PX + _GAP_PX, 0.0
    n_line, n_rim = 0, 0
    for k in range(len(pixels) - 1):
        u0, v0, u1, v1 = pixels[k, 0], pixels[k, 1], pixels[k + 1, 0], pixels[k + 1, 1]
        # A comparison with NaN is False.
        if not (abs(u0) < _FARTHEST_PX and abs(v0) < _FARTHEST_PX) or reach == 0.0:
            along = 0.0
            continue
        if not (abs(u1) < _FARTHEST_PX and abs(v1) < _FARTHEST_PX):
            continue
        u1, v1 = u0 + reach * (u1 - u0), v0 + reach * (v1 - v0)
        length = np.sqrt((u1 - u0) ** 2 + (v1 - v0) ** 2)
        n = int(length / _STEP_PX) + 1
        # Steps that are drawn alike are covered as one piece.
        kind, first = _HIDDEN, 0
        for step in range(n + 1):
            this = _HIDDEN
            if step < n:
                middle = (step + 0.5) / n
                u, v = u0 + middle * (u1 - u0), v0 + middle * (v1 - v0)
                z = depth_mm[k] + middle * (depth_mm[k + 1] - depth_mm[k])
                weight = weigh(u, v, z, ground) if np.isnan(of_whole) else of_whole
                along += length / n
                if weight > ground.beneath:
                    this = _ON_TOP
                elif weight >= 0.5 * ground.beneath and along % period <= _DASH_PX:
                    this = _BENEATH
            if this == kind and step < n:
                continue
            if kind != _HIDDEN:
                a, b = first / n, step / n
                ends = (
                    u0 + a * (u1 - u0), v0 + a * (v1 - v0), u0 + b * (u1 - u0), v0 + b * (v1 - v0)
                )  # fmt: skip
                rim = rim_px if kind == _ON_TOP else 0.0
                n_line, n_rim = _cover(ends, half_px, rim, room, n_line, n_rim)
            kind, first = this, step
    return n_line, n_rim


@njit(cache=True, nogil=True)
def _cover(
    ends: tuple[float, float, float, float],
    half_px: float,
    rim_px: float,
    room: Room,
    n_line: int,
    n_rim: int,
) -> tuple[int, int]:
    """Cover a piece with round ends, and its rim; their edges are one pixel wide."""
    u0, v0, u1, v1 = ends
    du, dv = u1 - u0, v1 - v0
    squared = du * du + dv * dv
    per_px = 1.0 / squared if squared > 0.0 else 0.0
    reach = half_px + rim_px + 0.5
    height, width = room.line.shape
    first_row, last_row = int(np.ceil(min(v0, v1) - reach)), int(np.floor(max(v0, v1) + reach))
    for row in range(max(0, first_row), min(last_row + 1, height)):
        # The part of the line that is within reach of this row.
        low, high = 0.0, 1.0
        if abs(dv) > 1e-9:
            a, b = (row - reach - v0) / dv, (row + reach - v0) / dv
            low, high = max(0.0, min(a, b)), min(1.0, max(a, b))
        left, right = u0 + low * du, u0 + high * du
        first = max(0, int(np.ceil(min(left, right) - reach)))
        last = min(width - 1, int(np.floor(max(left, right) + reach)))
        for column in range(first, last + 1):
            along = ((column - u0) * du + (row - v0) * dv) * per_px
            along = min(max(along, 0.0), 1.0)
            off_u, off_v = column - u0 - along * du, row - v0 - along * dv
            off_squared = off_u * off_u + off_v * off_v
            if off_squared >= reach * reach:
                continue
            inside = reach - np.sqrt(off_squared)
            n_line = _raise(room.line, room.touched[0], n_line, row, column, inside - rim_px)
            if rim_px > 0.0:
                n_rim = _raise(room.rim, room.touched[1], n_rim, row, column, inside)
    return n_line, n_rim


@njit(cache=True, nogil=True)
def _raise(
    share: NDArray[np.float32],
    touched: NDArray[np.int32],
    n: int,
    row: int,
    column: int,
    inside_px: float,
) -> int:
    """A pixel's share to what is covered of it, if that is more; how many pixels are touched."""
    covered = np.float32(min(inside_px, 1.0))
    if covered > share[row, column]:
        if share[row, column] == 0.0:
            if n == len(touched):
                return n
            touched[n] = row * share.shape[1] + column
            n += 1
        share[row, column] = covered
    return n


@njit(cache=True, nogil=True)
def _move(
    covered: NDArray[np.float32], touched: NDArray[np.int32], number: int, room: Room, n: int
) -> int:
    """From the pixels of one stroke to the list of all, whose length is returned."""
    shares = covered.reshape(covered.size)
    for place in touched:
        if n < len(room.place):
            room.place[n], room.share[n] = place, shares[place]
            room.number[n] = number
            n += 1
        shares[place] = np.float32(0.0)
    return n
