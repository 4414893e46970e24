"""Lines and crosses in space, drawn with soft edges at parts of a pixel."""

import threading
from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import Colour
from navapp.overlay.scene import Scene
from navapp.overlay.stroke_kernels import Ground, Pen, blend_touched, trace_line

Image = NDArray[np.uint8]

# Straight lines bend by lens and perspective: they are drawn in pieces as short as this.
_STEP_MM = 8.0
_DASH_PX, _GAP_PX, _RIM_PX = 7.0, 5.0, 1.0
# A rim in black keeps a line visible on bone and on blood.
_RIM: Colour = (0, 0, 0)
_BETWEEN = np.full((1, 3), np.nan)


def sample_line(points_mm: FloatArray, step_mm: float = _STEP_MM) -> FloatArray:
    """(M, 3) points on a polyline (N, 3), at most `step_mm` apart; its corners stay."""
    lengths_mm = np.linalg.norm(np.diff(points_mm, axis=0), axis=1)
    counts = np.maximum(1, np.ceil(lengths_mm / step_mm)).astype(int)
    at = [k + np.arange(n) / n for k, n in enumerate(counts)]
    places = np.concatenate([*at, [len(points_mm) - 1.0]])
    known = np.arange(len(points_mm))
    return np.column_stack([np.interp(places, known, points_mm[:, k]) for k in range(3)])


def draw_line(
    image: Image, scene: Scene, points_mm: FloatArray, colour: Colour, width_px: float = 2.0
) -> None:
    """A line through points (N, 3) of the bone's frame, some mm apart; as of `draw_lines`."""
    draw_lines(image, scene, [points_mm], colour, width_px)


def draw_lines(
    image: Image,
    scene: Scene,
    lines_mm: Iterable[FloatArray],
    colour: Colour,
    width_px: float = 2.0,
) -> None:
    """Lines through points (N, 3) each of the bone's frame, some mm apart.

    Dashed where it lies beneath something or where that is not known, left out where a hand or an
    instrument hides it.
    """
    # Unknown points part one line from the next: all are drawn in one go.
    parts = [part for line in lines_mm for part in (line, _BETWEEN)]
    if not parts:
        return
    in_camera = scene.to_camera(np.concatenate(parts))
    pixels = scene.camera.project(in_camera)
    rim_px = _RIM_PX if width_px > 1.0 and scene.viewpoint.is_video else 0.0
    _draw(image, pixels, in_camera[:, 2], scene.ground, width_px, rim_px, colour)


def cross_lines(point_mm: FloatArray, axes: FloatArray, half_mm: float) -> list[FloatArray]:
    """Two lines (3, 3) through a point, along two axes (2, 3)."""
    return [np.stack([point_mm - half_mm * a, point_mm, point_mm + half_mm * a]) for a in axes]


def draw_cross_px(image: Image, at_px: FloatArray, colour: Colour, half_px: float = 14.0) -> None:
    """A thin cross at a place (2,) of the picture, its middle left open."""
    # Nothing is known of the depth, and all is drawn as on top.
    nowhere, one = np.empty((0, 0), dtype=np.float32), np.float32(1.0)
    ground = Ground(0, 0, nowhere, nowhere, one, np.float32(0.5), one)
    for x, y in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        arm = at_px + half_px * np.array([[0.25 * x, 0.25 * y], [x, y]])
        _draw(image, arm, np.zeros(2), ground, 1.5, 0.0, colour)


@lru_cache(maxsize=8)
def _room(
    height: int, width: int, _thread: int
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
    """Room to draw a line in, of one thread: shares that are 0 before and after, and places."""
    line, rim = np.zeros((2, height, width), dtype=np.float32)
    return line, rim, np.empty((2, height * width), dtype=np.int32)


def _draw(
    image: Image,
    pixels: FloatArray,
    depth_mm: FloatArray,
    ground: Ground,
    width_px: float,
    rim_px: float,
    colour: Colour,
) -> None:
    """A line through places (N, 2) of the picture at depths (N,)."""
    line, rim, touched = _room(image.shape[0], image.shape[1], threading.get_ident())
    pen = Pen(*(np.float32(n) for n in (0.5 * width_px, rim_px, _DASH_PX, _GAP_PX)))
    depth_mm = np.ascontiguousarray(depth_mm)
    n_line, n_rim = trace_line(pixels, depth_mm, ground, pen, line, rim, touched)
    blend_touched(image, rim, touched[1, :n_rim], _RIM)
    blend_touched(image, line, touched[0, :n_line], colour)
