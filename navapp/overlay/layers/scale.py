"""A scale bar: how long a length at the bone's depth is in the picture."""

from functools import partial

import numpy as np

from navapp.geometry.box import Box
from navapp.overlay.colours import SCALE
from navapp.overlay.drawing import Drawing, find_middle_mm
from navapp.overlay.labels import Image, LabelBoard, put_text, text_size
from navapp.overlay.scene import Scene

_LENGTHS_MM = (5.0, 10.0, 20.0, 50.0)
_LEAST_PX = 70.0
_TICK_PX = 5


def draw_scale(scene: Scene, drawing: Drawing) -> None:
    """At the left, above the picture's last lines."""
    depth_mm = float(scene.to_camera(find_middle_mm(scene.mesh)[None])[0, 2])
    if depth_mm <= 0.0:
        return
    px_per_mm = scene.camera.focal_px / depth_mm
    length_mm = next((mm for mm in _LENGTHS_MM if mm * px_per_mm >= _LEAST_PX), _LENGTHS_MM[-1])
    drawing.panels.append(partial(_draw_bar, length_mm, length_mm * px_per_mm))


def _draw_bar(length_mm: float, length: float, image: Image, labels: LabelBoard) -> None:
    import cv2

    x, y = 16.0, image.shape[0] - 52.0
    bar = np.array([[x, y - _TICK_PX], [x, y], [x + length, y], [x + length, y - _TICK_PX]])
    told = np.round(bar * 16).astype(np.int32)
    cv2.polylines(image, [told], False, (0, 0, 0), 4, cv2.LINE_AA, 4)
    cv2.polylines(image, [told], False, SCALE, 2, cv2.LINE_AA, 4)
    text = f"{length_mm:.0f} mm at the bone"
    put_text(image, text, (round(x), round(y) - _TICK_PX - 6), labels.size, SCALE)
    width = max(round(length), text_size(text, labels.size)[0])
    labels.taken.append(Box(round(x) - 4, round(y) - 34, width + 8, 40))
