"""Lines and crosses in space, drawn with soft edges at parts of a pixel."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import Colour
from navapp.overlay.scene import Order, Scene

Image = NDArray[np.uint8]

# Places are told to OpenCV in 1/2^4 px.
_SHIFT, _FRACTIONS = 4, 16
_DASH_PX, _GAP_PX = 7.0, 5.0
# Beyond this OpenCV cannot draw: points beside the lens project millions of pixels away.
_FARTHEST_PX = 20_000.0
_STEP_MM = 1.0
# A rim in black keeps a thin line visible on bone and on blood.
_RIM: Colour = (0, 0, 0)


def sample_line(points_mm: FloatArray, step_mm: float = _STEP_MM) -> FloatArray:
    """(M, 3) points on a polyline (N, 3), at most `step_mm` apart; its corners stay."""
    pieces = [points_mm[:1]]
    for start, end in pairwise(points_mm):
        n = max(1, int(np.ceil(np.linalg.norm(end - start) / step_mm)))
        share = np.arange(1, n + 1)[:, None] / n
        pieces.append(start + share * (end - start))
    return np.concatenate(pieces)


def draw_line(
    image: Image, scene: Scene, points_mm: FloatArray, colour: Colour, width_px: int = 2
) -> None:
    """A line through points (N, 3) of the bone's frame, some mm apart.

    Dashed where it lies beneath something or where that is not known, left out where a hand or an
    instrument hides it.
    """
    _draw_lines(image, scene, [points_mm], colour, width_px)


def draw_cross(
    image: Image,
    scene: Scene,
    point_mm: FloatArray,
    axes: FloatArray,
    half_mm: float,
    colour: Colour,
) -> None:
    """Two strokes through a point of the bone's frame, along two axes (2, 3)."""
    ends = [np.stack([point_mm - half_mm * axis, point_mm + half_mm * axis]) for axis in axes]
    _draw_lines(image, scene, [sample_line(stroke) for stroke in ends], colour, 2)


def _draw_lines(
    image: Image, scene: Scene, lines: list[FloatArray], colour: Colour, width_px: int
) -> None:
    """All at once: the rim of one line does not cut another."""
    whole, dashes = [], []
    for points_mm in lines:
        for run, is_beneath in _runs(scene, points_mm):
            if is_beneath:
                dashes += _dashes(run)
            else:
                whole.append(run)
    _draw_pixels(image, whole, colour, width_px, has_rim=width_px > 1)
    _draw_pixels(image, dashes, colour, width_px, has_rim=False)


def _runs(scene: Scene, points_mm: FloatArray) -> list[tuple[FloatArray, bool]]:
    """Polylines in pixels of one order each, and whether beneath; hidden ones are left out."""
    if len(points_mm) < 2:
        return []
    in_camera = scene.to_camera(points_mm)
    pixels = scene.camera.project(in_camera)
    order = scene.order_of(pixels, in_camera[:, 2])
    # A piece is as visible as its less visible end.
    piece_order = np.maximum(order[:-1], order[1:])
    can_draw = np.all(np.abs(pixels) < _FARTHEST_PX, axis=1)
    piece_order[~(can_draw[:-1] & can_draw[1:])] = Order.HIDDEN
    ends = np.flatnonzero(np.diff(piece_order)) + 1
    runs = []
    for begin, end in zip((0, *ends), (*ends, len(piece_order)), strict=True):
        if piece_order[begin] != Order.HIDDEN:
            runs.append((pixels[begin : end + 1], piece_order[begin] == Order.BENEATH))
    return runs


def _dashes(pixels: FloatArray) -> list[FloatArray]:
    """The dashes of a polyline (N, 2)."""
    along = np.concatenate([[0.0], np.linalg.norm(np.diff(pixels, axis=0), axis=1).cumsum()])
    starts = np.arange(0.0, along[-1], _DASH_PX + _GAP_PX)
    dashes = []
    for start in starts:
        end = min(start + _DASH_PX, along[-1])
        inner = along[(along > start) & (along < end)]
        at = np.concatenate([[start], inner, [end]])
        dashes.append(np.column_stack([np.interp(at, along, pixels[:, k]) for k in (0, 1)]))
    return dashes


def _draw_pixels(
    image: Image, lines: list[FloatArray], colour: Colour, width_px: int, *, has_rim: bool
) -> None:
    import cv2

    told = [np.round(line * _FRACTIONS).astype(np.int32) for line in lines]
    if has_rim:
        cv2.polylines(image, told, False, _RIM, width_px + 2, cv2.LINE_AA, _SHIFT)
    cv2.polylines(image, told, False, colour, width_px, cv2.LINE_AA, _SHIFT)
