"""A pair at half its resolution, and the way back.

One pixel is the mean of four: pixel k of the half lies at 2 k + 0.5 of the whole, and a disparity
of the whole is exactly twice that of the half.
"""

from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Box, Image, RectifiedPair

T = TypeVar("T", bound=np.generic)


def halved(pair: RectifiedPair) -> RectifiedPair:
    """The pair at half its resolution; an odd last row or column is left out."""
    import cv2

    geometry = pair.geometry
    height, width = (length // 2 for length in pair.left.shape)

    def half(image: Image) -> Image:
        even = image[: 2 * height, : 2 * width]
        return np.asarray(cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA), np.uint8)

    return RectifiedPair(
        half(pair.left),
        half(pair.right),
        replace(
            geometry,
            focal_px=geometry.focal_px / 2.0,
            centre_x_px=(geometry.centre_x_px - 0.5) / 2.0,
            centre_y_px=(geometry.centre_y_px - 0.5) / 2.0,
            width=width,
            height=height,
        ),
        half_box(pair.box),
    )


def half_box(box: Box) -> Box:
    """The pixels of the half that cover a box of the whole."""
    x, y = box.x // 2, box.y // 2
    return Box(x, y, -(-(box.x + box.width) // 2) - x, -(-(box.y + box.height) // 2) - y)


def doubled_disparity(half_px: NDArray[np.float32], box: Box) -> NDArray[np.float32]:
    """(h, w) disparity over a box of the whole, from that over `half_box(box)`; interpolated.

    A pixel whose half pixel is known is known: unknown neighbours do not spread.
    """
    import cv2

    height, width = half_px.shape
    # OpenCV's enlargement puts the half's pixel k at 2 k + 0.5, as it should be.
    between = cv2.resize(half_px, (2 * width, 2 * height), interpolation=cv2.INTER_LINEAR)
    between = between[_inside(box)]
    finest = np.where(np.isfinite(between), between, doubled(half_px, box))
    return np.asarray(np.float32(2.0) * finest, dtype=np.float32)


def doubled(half: NDArray[T], box: Box) -> NDArray[T]:
    """(h, w) values over a box of the whole: those of the half pixel each pixel lies in."""
    return np.repeat(np.repeat(half, 2, axis=0), 2, axis=1)[_inside(box)]


def _inside(box: Box) -> tuple[slice, slice]:
    """The box's rows and columns among the pixels that its half covers."""
    top, left = box.y % 2, box.x % 2
    return slice(top, top + box.height), slice(left, left + box.width)
