"""Fits pictures into what the screen has room for."""

import cv2
import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box

Image = NDArray[np.uint8]

# What lies around a bone is shown with it, as a part of its size.
_MARGIN = 0.2
# A part of the picture that is shown is at least so wide.
_LEAST_SHARE = 0.25
# The shown part stays while the bone lies in it and it is not so much wider than needed.
_MOST_EXCESS = 1.5
# Below this, pixels between are lost without a mean over areas, which takes six times as long.
_MUCH_SMALLER = 0.6


def in_colour(picture: Image) -> Image:
    """(h, w, 3) of a picture in grey or colour."""
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
    if picture.shape[:2] == (height, width):
        return picture
    is_much_smaller = width < _MUCH_SMALLER * picture.shape[1]
    how = cv2.INTER_AREA if is_much_smaller else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(picture, (width, height), interpolation=how), dtype=np.uint8)


def put_on_canvas(picture: Image, width: int, height: int) -> Image:
    """(height, width, 3): the picture as large as possible in the middle, black beside it."""
    size = fit_size(picture.shape, width, height)
    fitted = in_colour(resize(picture, *size))
    if size == (width, height):
        # Encoders are compiled for one kind of array.
        return np.ascontiguousarray(fitted) if fitted is not picture else picture.copy()
    canvas = np.zeros((height, width, 3), dtype=np.uint8)
    x, y = (width - size[0]) // 2, (height - size[1]) // 2
    canvas[y : y + size[1], x : x + size[0]] = fitted
    return canvas


def find_point(
    shape: tuple[int, ...], room: tuple[int, int], at: tuple[float, float]
) -> tuple[float, float]:
    """Which point of a picture is seen at a place of its canvas: parts of its width and height.

    Args:
        shape: (h, w) of the picture.
        room: width and height of the canvas.
        at: column and row in it; beside the picture the nearest point of its edge is told.
    """
    size = fit_size(shape, *room)
    across, down = (
        (place - (whole - own) // 2) / own for place, whole, own in zip(at, room, size, strict=True)
    )
    return min(max(across, 0.0), 1.0), min(max(down, 0.0), 1.0)


def choose_part(
    bone: Box, size_px: tuple[int, int], aspect: float, previous: Box | None = None
) -> Box:
    """The part of a picture around a bone.

    Args:
        bone: where it lies in the picture.
        size_px: width and height of the picture.
        aspect: width over height of the room on the screen.
        previous: part that was shown before; it stays while it fits.
    """
    width = max(bone.width * (1 + 2 * _MARGIN), bone.height * (1 + 2 * _MARGIN) * aspect)
    width = max(width, _LEAST_SHARE * size_px[0])
    size = round(min(width, size_px[0])), round(min(width / aspect, size_px[1]))
    if (
        previous is not None
        and previous.intersect(bone) == bone
        and previous.width <= _MOST_EXCESS * size[0]
        and abs(previous.width / previous.height - size[0] / size[1]) < 0.1
    ):
        return previous
    x, y = (
        min(max(round(at + 0.5 * extent - 0.5 * own), 0), most - own)
        for at, extent, own, most in (
            (bone.x, bone.width, size[0], size_px[0]),
            (bone.y, bone.height, size[1], size_px[1]),
        )
    )
    return Box(x, y, *size)
