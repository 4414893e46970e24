"""Targets: points that are planned one by one. Where only the error is judged, nothing is drawn."""

import numpy as np

from navapp.overlay.colours import TARGET
from navapp.overlay.drawing import Drawing
from navapp.overlay.scene import Scene

_HALF_MM = 3.0


def draw_targets(scene: Scene, drawing: Drawing) -> None:
    """The stage's targets of one point as crosses with their names."""
    axes = scene.picture_axes_in_bone
    for name in scene.stage.targets:
        points = scene.plan.targets.get(name)
        # A group of points is where the error is judged, and no place for a tool.
        if points is None or points.size != 3 or not name.startswith(f"{scene.stage.bone}/"):
            continue
        point_mm = np.asarray(points, dtype=np.float64).reshape(3)
        drawing.cross(point_mm, axes, _HALF_MM, TARGET)
        drawing.label(name.split("/", 1)[1].replace("_", " "), point_mm, TARGET)
