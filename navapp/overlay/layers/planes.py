"""Planned cuts: the line in which the blade leaves the bone, and the plane's frame."""

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import PLANE
from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.plane_sections import cut_lines
from navapp.overlay.scene import Scene
from navapp.overlay.strokes import draw_lines, sample_line


def draw_planes(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """The stage's planes."""
    frames: list[FloatArray] = []
    cuts: list[FloatArray] = []
    for name, plane in scene.planes.items():
        corners = plane.corners_mm()
        frames.append(sample_line(np.vstack([corners, corners[:1]])))
        cuts += cut_lines(scene.drawn_mesh, plane)
        words = name.removeprefix(f"{scene.stage.bone}_").replace("_", " ")
        labels.add(f"{words} cut", scene.pixel_of(corners[1]), PLANE)
    draw_lines(image, scene, frames, PLANE, 1.0)
    draw_lines(image, scene, cuts, PLANE)
