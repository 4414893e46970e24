"""The printed plate of a tool: square markers on one or several flat faces.

The plate's frame: origin in the middle of the first face, x along its columns, y down its rows, z
away from who reads it (mm). Further faces form a strip: each is hinged at the right edge of the one
before and folded away from who reads.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, rotation_from_vector


@dataclass(frozen=True)
class Plate:
    """Markers of one dictionary, in rows and columns on every face."""

    dictionary: str = "DICT_4X4_100"  # OpenCV's name
    first_id: int = 0  # of the first face's first marker; the others follow, row by row
    # columns, rows: markers of a face.
    columns: int = 2
    rows: int = 2
    square_mm: float = 20.0  # side of the square in whose middle each marker stands
    marker_mm: float = 16.0  # side of a marker
    faces: int = 1
    fold_deg: float = 0.0  # by which each face is turned away against the one before

    @property
    def face_size_mm(self) -> tuple[float, float]:
        """Width and height of a face."""
        return self.columns * self.square_mm, self.rows * self.square_mm

    @property
    def margin_mm(self) -> float:
        """White between a marker and the edge of its square."""
        return 0.5 * (self.square_mm - self.marker_mm)

    @property
    def ids(self) -> range:
        """Of all its markers."""
        return range(self.first_id, self.first_id + self.faces * self.columns * self.rows)

    @property
    def n_cells(self) -> int:
        """Cells along a marker's side, its black border included."""
        return int(self.opencv_dictionary.markerSize) + 2

    @cached_property
    def opencv_dictionary(self) -> Any:
        """OpenCV's object."""
        import cv2

        return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))

    @cached_property
    def plate_from_faces(self) -> FloatArray:
        """(faces, 4, 4) poses of the faces, each with its frame in its middle."""
        half = np.eye(4)
        half[0, 3] = 0.5 * self.face_size_mm[0]
        fold = np.eye(4)
        fold[:3, :3] = rotation_from_vector((0.0, -math.radians(self.fold_deg), 0.0))
        poses = [np.eye(4)]
        for _ in range(1, self.faces):
            poses.append(poses[-1] @ half @ fold @ half)
        return np.array(poses)

    @cached_property
    def marker_corners_mm(self) -> FloatArray:
        """(faces, markers, 4, 2) in the face's frame: upper left, upper right, then clockwise."""
        width, height = self.face_size_mm
        left = self.margin_mm - 0.5 * width + self.square_mm * np.arange(self.columns)
        top = self.margin_mm - 0.5 * height + self.square_mm * np.arange(self.rows)
        x, y = np.meshgrid(left, top)
        square = self.marker_mm * np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64)
        corners = np.stack([x.ravel(), y.ravel()], axis=1)[:, None] + square
        return np.repeat(corners[None], self.faces, axis=0)

    @cached_property
    def corners_mm(self) -> FloatArray:
        """(markers of all faces, 4, 3) the same in the plate's frame, in the order of `ids`."""
        flat = self.marker_corners_mm
        solid = np.concatenate([flat, np.zeros((*flat.shape[:3], 1))], axis=3)
        placed = [
            corners @ pose[:3, :3].T + pose[:3, 3]
            for corners, pose in zip(solid, self.plate_from_faces, strict=True)
        ]
        return np.concatenate(placed)

    def black_cells(self, marker_id: int) -> NDArray[np.bool_]:
        """(n, n) cells of a marker that are black."""
        n = self.n_cells
        drawn = np.asarray(self.opencv_dictionary.generateImageMarker(marker_id, n))
        return np.asarray(drawn == 0)

    def __str__(self) -> str:
        width, height = self.face_size_mm
        faces = "one face" if self.faces == 1 else f"{self.faces} faces"
        return f"plate with {faces} of {width:g} x {height:g} mm, {self.dictionary}"
