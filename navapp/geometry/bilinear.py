"""Where a new picture's pixels lie in the raw one, and what other programs read there."""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray

# Cubic over six pixels is what disparities are measured on, bilinear what other programs do.
Interpolation = Literal["cubic", "bilinear"]


def lens_maps(camera: Camera, rotation: FloatArray, projection: FloatArray) -> tuple[Any, Any]:
    """Where a turned camera without distortion looks.

    Args:
        camera: that took the raw picture.
        rotation: (3, 3) turned from raw camera.
        projection: (3, 3) or (3, 4) matrix of the turned camera, px.

    Returns:
        Columns and rows (h, w) of the raw picture, float32: fixed-point maps differ by up to 2
        grey levels.
    """
    import cv2

    columns, rows = cv2.initUndistortRectifyMap(
        np.array(camera.matrix),
        np.array(camera.distortion),
        np.array(rotation),
        np.array(projection),
        (camera.width, camera.height),
        cv2.CV_32FC1,
    )
    return columns, rows


def bilinear(
    picture: NDArray[np.uint8],
    columns: NDArray[np.float32],
    rows: NDArray[np.float32],
    inside: tuple[slice, slice],
) -> NDArray[np.uint8]:
    """The picture at real places (h, w), over four pixels; 0 outside it, and outside a part.

    Args:
        picture: (H, W) or (H, W, n).
        columns: (h, w) places.
        rows: (h, w) places.
        inside: rows and columns of the part.
    """
    import cv2

    values = np.zeros((*columns.shape, *picture.shape[2:]), dtype=np.uint8)
    if values[inside].size > 0:
        values[inside] = cv2.remap(picture, columns[inside], rows[inside], cv2.INTER_LINEAR)
    return values
