"""Planned holes: entry, direction and depth."""

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import DRILL
from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.scene import Scene
from navapp.overlay.strokes import draw_cross, draw_line, sample_line

# The axis is drawn so far out of the bone, towards the hand that drills.
_OUTSIDE_MM = 30.0
_N_AROUND = 48


def draw_drills(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """The stage's drill axes: a cross and the hole's rim at the entry, the axis, the end."""
    for name, drill in scene.drills.items():
        axes = _across(drill.direction)
        end = drill.entry_mm + drill.depth_mm * drill.direction
        start = drill.entry_mm - _OUTSIDE_MM * drill.direction
        draw_line(image, scene, sample_line(np.stack([start, end])), DRILL, 1)
        for centre in (drill.entry_mm, end):
            rim = _circle(centre, axes, 0.5 * drill.diameter_mm)
            draw_line(image, scene, rim, DRILL, 2 if centre is drill.entry_mm else 1)
        draw_cross(image, scene, drill.entry_mm, axes, 0.9 * drill.diameter_mm, DRILL)
        words = name.replace("_", " ")
        text = f"{words}: {drill.depth_mm:.0f} mm deep, {drill.diameter_mm:g} mm wide"
        labels.add(text, scene.pixel_of(drill.entry_mm), DRILL)


def _across(direction: FloatArray) -> FloatArray:
    """(2, 3) unit axes at right angles to a direction and to each other."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    first = np.cross(direction, helper)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first)])


def _circle(centre: FloatArray, axes: FloatArray, radius_mm: float) -> FloatArray:
    angles = 2.0 * np.pi * np.arange(_N_AROUND + 1) / _N_AROUND
    on_rim = np.column_stack([np.cos(angles), np.sin(angles)]) @ axes
    points: FloatArray = centre + radius_mm * on_rim
    return points
