"""Places in a picture at half its resolution: pixel k of the half covers 2 k and 2 k + 1."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box

T = TypeVar("T", bound=np.generic)


def half_box(box: Box) -> Box:
    """The pixels of the half that cover a box of the whole."""
    x, y = box.x // 2, box.y // 2
    return Box(x, y, -(-(box.x + box.width) // 2) - x, -(-(box.y + box.height) // 2) - y)


def double(half: NDArray[T], box: Box) -> NDArray[T]:
    """(h, w) values over a box of the whole: those of the half pixel each pixel lies in."""
    import cv2

    height, width = half.shape
    if half.size == 0:
        return np.empty((box.height, box.width), dtype=half.dtype)
    size = (2 * width, 2 * height)
    whole = cv2.resize(half, size, interpolation=cv2.INTER_NEAREST)  # type: ignore[arg-type]
    return np.asarray(whole[inside_of_halves(box)], dtype=half.dtype)


def inside_of_halves(box: Box) -> tuple[slice, slice]:
    """The box's rows and columns among the pixels that its half covers."""
    top, left = box.y % 2, box.x % 2
    return slice(top, top + box.height), slice(left, left + box.width)


def mean_blocks(values: NDArray[T], reduction: int) -> NDArray[T]:
    """(h / reduction, w / reduction) means of blocks."""
    import cv2

    size = values.shape[1] // reduction, values.shape[0] // reduction
    reduced = cv2.resize(values, size, interpolation=cv2.INTER_AREA)  # type: ignore[arg-type]
    return np.asarray(reduced, dtype=values.dtype)
