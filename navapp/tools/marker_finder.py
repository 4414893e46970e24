"""Finds a plate's markers in one picture."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.tools.plate import Plate

Box = tuple[int, int, int, int]  # x, y, width, height


@dataclass(frozen=True, slots=True, eq=False)
class SeenMarkers:
    """Markers of a plate in a picture."""

    markers: NDArray[np.intp]  # (n,) counted from the plate's first
    corners_px: FloatArray  # (n, 4, 2) in the order of `Plate.corners_mm`


class MarkerFinder:
    """OpenCV's detector, set for one plate.

    Args:
        plate: whose markers are looked for.
    """

    def __init__(self, plate: Plate) -> None:
        import cv2

        self._plate = plate
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        settings.cornerRefinementWinSize = 3
        settings.adaptiveThreshWinSizeMin = 7
        settings.adaptiveThreshWinSizeMax = 23
        settings.adaptiveThreshWinSizeStep = 16
        self._detector: Any = cv2.aruco.ArucoDetector(plate.opencv_dictionary, settings)

    def find(self, picture: NDArray[np.uint8], box: Box | None = None) -> SeenMarkers:
        """All markers of the plate that are seen.

        Args:
            picture: (H, W) grey.
            box: only this part is looked at.
        """
        shift = np.zeros(2)
        if box is not None:
            x, y, width, height = box
            picture = np.ascontiguousarray(picture[y : y + height, x : x + width])
            shift = np.array([x, y], dtype=np.float64)
        corners, ids, _ = self._detector.detectMarkers(picture)
        known = self._plate.ids
        numbers = [] if ids is None else np.ravel(ids).tolist()
        found = dict(zip(numbers, corners, strict=True))
        # Of a marker that is there twice nobody knows which is the tool's.
        kept = sorted(one for one in found if one in known and numbers.count(one) == 1)
        pixels = [np.asarray(found[number], dtype=np.float64).reshape(4, 2) for number in kept]
        return SeenMarkers(
            np.array([number - known.start for number in kept], dtype=np.intp),
            np.array(pixels).reshape(-1, 4, 2) + shift,
        )
