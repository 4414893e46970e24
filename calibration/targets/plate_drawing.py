"""A tool's plate as black shapes: all faces in one strip, to be folded."""

import numpy as np

from calibration.targets.drawing import Drawing
from navapp.geometry.transform import FloatArray
from navapp.tools.plate import Plate


def draw_plate(plate: Plate) -> Drawing:
    """Black cells of all faces side by side; the first face's upper left corner is the origin."""
    width, height = plate.face_size_mm
    cell_mm = plate.marker_mm / plate.n_cells
    corners = plate.marker_corners_mm[:, :, 0] + 0.5 * np.array([width, height])
    corners = corners + np.arange(plate.faces)[:, None, None] * (width, 0.0)
    rectangles: list[FloatArray] = []
    for corner, marker_id in zip(corners.reshape(-1, 2), plate.ids, strict=True):
        for row, line in enumerate(plate.black_cells(marker_id)):
            ends = np.flatnonzero(np.diff(np.r_[0, line.astype(int), 0])).reshape(-1, 2)
            rectangles += [
                np.tile(corner, 2) + cell_mm * np.array([first, row, last, row + 1])
                for first, last in ends
            ]
    high = np.array([plate.faces * width, height])
    return Drawing(np.array(rectangles), np.empty((0, 3)), np.zeros(2), high)
