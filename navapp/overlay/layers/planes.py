"""Planned cuts: the line in which the blade leaves the bone, and the plane's frame."""

import numpy as np

from navapp.overlay.colours import PLANE
from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.plane_sections import cut_lines
from navapp.overlay.scene import Scene
from navapp.overlay.strokes import draw_line, sample_line


def draw_planes(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """The stage's planes."""
    for name, plane in scene.planes.items():
        corners = plane.corners_mm()
        draw_line(image, scene, sample_line(np.vstack([corners, corners[:1]]), 4.0), PLANE, 1)
        for line in cut_lines(scene.drawn_mesh, plane):
            draw_line(image, scene, line, PLANE, 2)
        words = name.removeprefix(f"{scene.stage.bone}_").replace("_", " ")
        labels.add(f"{words} cut", scene.pixel_of(corners[1]), PLANE)
