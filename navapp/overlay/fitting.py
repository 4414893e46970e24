"""Fits pictures into what a display or a screen has room for."""

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]

# Below this, pixels between are lost without a mean over areas, which takes four times as long.
_MUCH_SMALLER = 0.6


def in_colour(picture: Image) -> Image:
    """(h, w, 3) of a picture in grey or colour."""
    import cv2

    if picture.ndim == 3:
        return picture
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def fit_size(shape: tuple[int, ...], width: float, height: float) -> tuple[int, int]:
    """Width and height of the largest picture of that shape (h, w) in so much room."""
    scale = min(width / shape[1], height / shape[0])
    return (
        min(max(round(shape[1] * scale), 1), max(int(width), 1)),
        min(max(round(shape[0] * scale), 1), max(int(height), 1)),
    )


def resize(picture: Image, width: int, height: int) -> Image:
    """(height, width[, 3]); much smaller ones are means over areas."""
    import cv2

    if picture.shape[:2] == (height, width):
        return picture
    is_much_smaller = width < _MUCH_SMALLER * picture.shape[1]
    how = cv2.INTER_AREA if is_much_smaller else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(picture, (width, height), interpolation=how), dtype=np.uint8)


def put_on_canvas(picture: Image, width: int, height: int) -> Image:
    """(height, width, 3): the picture as large as possible in the middle, black beside it.

    A picture in colour and of that size is passed on as it is.
    """
    size = fit_size(picture.shape, width, height)
    fitted = in_colour(resize(picture, *size))
    if size == (width, height):
        return fitted
    canvas = np.zeros((height, width, 3), dtype=np.uint8)
    x, y = (width - size[0]) // 2, (height - size[1]) // 2
    canvas[y : y + size[1], x : x + size[0]] = fitted
    return canvas
