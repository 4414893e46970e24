"""Lines and crosses in space, drawn with soft edges at parts of a pixel."""

import threading
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import Colour
from navapp.overlay.drawing import Stroke
from navapp.overlay.scene import Scene
from navapp.overlay.stroke_kernels import Ground, Room, blend_places, trace_lines

Image = NDArray[np.uint8]

# Straight lines bend by lens and perspective: they are drawn in pieces as short as this.
_STEP_MM = 8.0
# Points of a curve are left out where it stays so straight: each costs a round end.
_STRAIGHT_MM = 0.05
# A rim in black keeps a line visible on bone and on blood.
_RIM_PX = 1.0
# Room for this share of a picture's pixels, each counted as often as it is drawn; more is made when
# that is not enough.
_MOSTLY_DRAWN = 0.25


def thin_line(points_mm: FloatArray, straight_mm: float = _STRAIGHT_MM) -> FloatArray:
    """(M, 3) of the points of a polyline (N, 3), with straight lines between them as near to all.

    Source: Douglas and Peucker 1973.
    """
    is_kept = np.zeros(len(points_mm), dtype=np.bool_)
    is_kept[[0, -1]] = True
    parts = [(0, len(points_mm) - 1)]
    while parts:
        first, last = parts.pop()
        start, along = points_mm[first], points_mm[last] - points_mm[first]
        off = points_mm[first + 1 : last] - start
        share = off @ along / max(float(along @ along), 1e-12)
        off_mm = np.linalg.norm(off - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1)
        if len(off_mm) and off_mm.max() > straight_mm:
            middle = first + 1 + int(off_mm.argmax())
            is_kept[middle] = True
            parts += [(first, middle), (middle, last)]
    thinned: FloatArray = points_mm[is_kept]
    return thinned


def sample_line(points_mm: FloatArray, step_mm: float = _STEP_MM) -> FloatArray:
    """(M, 3) points on a polyline (N, 3), at most `step_mm` apart; its corners stay."""
    lengths_mm = np.linalg.norm(np.diff(points_mm, axis=0), axis=1)
    counts = np.maximum(1, np.ceil(lengths_mm / step_mm)).astype(int)
    at = [k + np.arange(n) / n for k, n in enumerate(counts)]
    places = np.concatenate([*at, [len(points_mm) - 1.0]])
    known = np.arange(len(points_mm))
    return np.column_stack([np.interp(places, known, points_mm[:, k]) for k in range(3)])


class PlacedStrokes(NamedTuple):
    """Strokes where they are in the picture, from below to above."""

    pixels: FloatArray  # (N, 2) of the points of all of them; NaN where they are not seen
    depth_mm: FloatArray  # (N,)
    firsts: NDArray[np.int64]  # (S + 1,) number of each stroke's first point, and N
    is_whole: NDArray[np.bool_]  # (S,) see `Stroke.is_judged_whole`
    half_px: FloatArray  # (S,) half of their widths
    rim_px: FloatArray  # (S,)
    colours: NDArray[np.float32]  # (S, 3)


class TracedStrokes(NamedTuple):
    """Which pixels strokes cover, and how much of each."""

    room: Room  # its first places, until it is traced in again
    n_places: int
    colours: NDArray[np.float32]  # (S, 3) of the strokes


def place_strokes(scene: Scene, strokes: Sequence[Stroke]) -> PlacedStrokes | None:
    """Where strokes are in the picture; None without any."""
    if not strokes:
        return None
    in_camera = scene.to_camera(np.concatenate([stroke.points_mm for stroke in strokes]))
    widths = np.array([stroke.width_px for stroke in strokes])
    has_rim = scene.viewpoint.is_video & (widths > 1.0)
    return PlacedStrokes(
        scene.camera.project(in_camera),
        np.ascontiguousarray(in_camera[:, 2]),
        np.cumsum([0, *(len(stroke.points_mm) for stroke in strokes)]),
        np.array([stroke.is_judged_whole for stroke in strokes]),
        0.5 * widths,
        np.where(has_rim, _RIM_PX, 0.0),
        np.array([stroke.colour for stroke in strokes], dtype=np.float32),
    )


def trace_strokes(scene: Scene, placed: PlacedStrokes | None, thread: int) -> TracedStrokes | None:
    """Trace strokes in their order.

    They are dashed where they lie beneath something or where that is not known, left out where a
    hand or an instrument hides them.

    Args:
        scene: that they belong to.
        placed: the strokes.
        thread: that blends them, before it asks for others.
    """
    if placed is None:
        return None
    room = _room(scene.camera.height, scene.camera.width, thread)
    return _trace(room, placed, scene.ground)


def blend_strokes(image: Image, traced: TracedStrokes | None) -> None:
    """Draw them into a picture (H, W, 3)."""
    if traced is not None:
        room, n, colours = traced
        blend_places(image.reshape(-1, 3), room.place[:n], room.share[:n], room.number[:n], colours)


def draw_cross_px(image: Image, at_px: FloatArray, colour: Colour, half_px: float = 14.0) -> None:
    """A thin cross at a place (2,) of the picture, its middle left open."""
    # Nothing is known of the depth, and all is drawn as on top.
    nowhere, one = np.empty((0, 0), dtype=np.float32), np.float32(1.0)
    hidden = np.empty((0, 0), dtype=np.bool_)
    ground = Ground(0, 0, nowhere, nowhere, hidden, one, np.float32(0.5), one)
    arms = [
        at_px + half_px * np.array([[0.25 * x, 0.25 * y], [x, y]])
        for x, y in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
    ]
    placed = PlacedStrokes(
        np.concatenate(arms),
        np.zeros(8),
        np.arange(0, 9, 2),
        np.zeros(4, dtype=np.bool_),
        np.full(4, 0.75),
        np.zeros(4),
        np.full((4, 3), colour, dtype=np.float32),
    )
    room = _room(image.shape[0], image.shape[1], threading.get_ident())
    blend_strokes(image, _trace(room, placed, ground))


def _trace(room: Room, placed: PlacedStrokes, ground: Ground) -> TracedStrokes:
    lines = (
        placed.pixels, placed.depth_mm, placed.firsts, placed.is_whole, placed.half_px,
        placed.rim_px,
    )  # fmt: skip
    n = trace_lines(*lines, ground, room)
    while n == len(room.place):
        room = _enlarge(room)
        n = trace_lines(*lines, ground, room)
    return TracedStrokes(room, n, placed.colours)


def _enlarge(room: Room) -> Room:
    """Room for twice as many places."""
    n = 2 * len(room.place)
    place, number = np.empty((2, n), dtype=np.int32)
    return room._replace(place=place, share=np.empty(n, dtype=np.float32), number=number)


@lru_cache(maxsize=4)
def _room(height: int, width: int, _thread: int) -> Room:
    """Room to draw lines in, of one thread."""
    line, rim = np.zeros((2, height, width), dtype=np.float32)
    touched = np.empty((2, height * width), dtype=np.int32)
    n = int(_MOSTLY_DRAWN * height * width)
    place, number = np.empty((2, n), dtype=np.int32)
    return Room(line, rim, touched, place, np.empty(n, dtype=np.float32), number)
