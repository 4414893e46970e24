"""Planned holes: entry, direction and depth."""

from functools import lru_cache

import numpy as np

from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import DRILL
from navapp.overlay.drawing import Drawing
from navapp.overlay.scene import Scene
from navapp.overlay.strokes import sample_line
from navapp.values import DrillAxis

# The axis is drawn so far out of the bone, towards the hand that drills.
_OUTSIDE_MM = 30.0
_N_AROUND = 24


def draw_drills(scene: Scene, drawing: Drawing) -> None:
    """The stage's drill axes: a cross and the hole's rim at the entry, the axis, the end."""
    for name, drill in scene.drills.items():
        axes, axis_and_end, rim = _lines(drill)
        drawing.lines(axis_and_end, DRILL, 1.0)
        drawing.lines([rim], DRILL)
        drawing.cross(drill.entry_mm, axes, 0.9 * drill.diameter_mm, DRILL)
        words = name.replace("_", " ")
        text = f"{words}: {drill.depth_mm:.0f} mm deep, {drill.diameter_mm:g} mm wide"
        drawing.label(text, drill.entry_mm, DRILL)


@lru_cache(maxsize=64)
def _lines(drill: DrillAxis) -> tuple[FloatArray, list[FloatArray], FloatArray]:
    """Axes (2, 3) across it; points (N, 3) of the axis and of the hole's end, and of its entry."""
    axes = perpendicular_axes(drill.direction[None])[0]
    end = drill.entry_mm + drill.depth_mm * drill.direction
    start = drill.entry_mm - _OUTSIDE_MM * drill.direction
    radius_mm = 0.5 * drill.diameter_mm
    axis_and_end = [sample_line(np.stack([start, end])), _circle(end, axes, radius_mm)]
    return axes, axis_and_end, _circle(drill.entry_mm, axes, radius_mm)


def _circle(centre: FloatArray, axes: FloatArray, radius_mm: float) -> FloatArray:
    angles = 2.0 * np.pi * np.arange(_N_AROUND + 1) / _N_AROUND
    on_rim = np.column_stack([np.cos(angles), np.sin(angles)]) @ axes
    points: FloatArray = centre + radius_mm * on_rim
    return points
