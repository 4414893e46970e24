"""Planned cuts: the line in which the blade leaves the bone, and the plane's frame."""

from functools import lru_cache

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import PLANE
from navapp.overlay.drawing import Drawing
from navapp.overlay.plane_sections import cut_lines
from navapp.overlay.scene import Scene
from navapp.overlay.strokes import sample_line, thin_line
from navapp.values import ResectionPlane


def draw_planes(scene: Scene, drawing: Drawing) -> None:
    """The stage's planes."""
    cuts: list[FloatArray] = []
    for name, plane in scene.planes.items():
        drawing.lines([_frame(plane)], PLANE, 1.0)
        cuts += _cut_lines(scene.drawn_mesh, plane)
        words = name.removeprefix(f"{scene.stage.bone}_").replace("_", " ")
        drawing.label(f"{words} cut", _label_mm(plane), PLANE)
    drawing.lines(cuts, PLANE)


@lru_cache(maxsize=64)
def _cut_lines(mesh: TriangleMesh, plane: ResectionPlane) -> list[FloatArray]:
    """Points (N, 3) of each line."""
    return [sample_line(thin_line(line)) for line in cut_lines(mesh, plane)]


@lru_cache(maxsize=64)
def _label_mm(plane: ResectionPlane) -> FloatArray:
    """(3,) the corner that is named."""
    corner_mm: FloatArray = plane.corners_mm()[1]
    return corner_mm


@lru_cache(maxsize=64)
def _frame(plane: ResectionPlane) -> FloatArray:
    """(N, 3) points on the planned rectangle."""
    corners = plane.corners_mm()
    return sample_line(np.vstack([corners, corners[:1]]))
