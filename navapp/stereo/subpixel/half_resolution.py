"""A pair at half its resolution, and the way back.

One pixel is the mean of four: pixel k of the half lies at 2 k + 0.5 of the whole, and a disparity
of the whole is exactly twice that of the half.
"""

import math
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.masks import where
from navapp.geometry.rectification import Image, RectifiedPair

# What windows and the steps at the ends of a search ask for beside a box.
_WINDOW_PX = 8

T = TypeVar("T", bound=np.generic)


def halved(pair: RectifiedPair, band_px: tuple[float, float] | None = None) -> RectifiedPair:
    """The pair at half its resolution; an odd last row or column is left out.

    Args:
        pair: rectified grey pictures.
        band_px: smallest and largest disparity. With it only the pair's box, and what it reaches in
            the right picture, is made; the rest is 0.
    """
    geometry = pair.geometry
    height, width = (length // 2 for length in pair.left.shape)
    half, whole = half_box(pair.box), Box(0, 0, width, height)
    in_left = in_right = whole
    if band_px is not None:
        in_left = half.grown(_WINDOW_PX)
        # From the farthest partner of the first column to the nearest of the last.
        farthest, nearest = math.ceil(band_px[1] / 2.0), math.floor(band_px[0] / 2.0)
        first, after = in_left.x - farthest, in_left.x + in_left.width - nearest
        in_right = replace(in_left, x=first, width=max(after - first, 0))
    return RectifiedPair(
        _halved(pair.left, in_left.clipped(width, height), whole),
        _halved(pair.right, in_right.clipped(width, height), whole),
        replace(
            geometry,
            focal_px=geometry.focal_px / 2.0,
            centre_x_px=(geometry.centre_x_px - 0.5) / 2.0,
            centre_y_px=(geometry.centre_y_px - 0.5) / 2.0,
            width=width,
            height=height,
        ),
        half,
    )


def _halved(image: Image, part: Box, whole: Box) -> Image:
    """A part (of the half) of a picture at half its resolution; 0 elsewhere."""
    import cv2

    small = np.zeros((whole.height, whole.width), dtype=np.uint8)
    if not part.is_empty:
        rows, columns = (
            slice(part.y, part.y + part.height), slice(part.x, part.x + part.width)
        )  # fmt: skip
        even = image[2 * rows.start : 2 * rows.stop, 2 * columns.start : 2 * columns.stop]
        size = (part.width, part.height)
        cv2.resize(even, size, dst=small[rows, columns], interpolation=cv2.INTER_AREA)
    return small


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
    finest = where(np.isfinite(between), between, doubled(half_px, box))
    return np.asarray(np.float32(2.0) * finest, dtype=np.float32)


def doubled(half: NDArray[T], box: Box) -> NDArray[T]:
    """(h, w) values over a box of the whole: those of the half pixel each pixel lies in."""
    return np.repeat(np.repeat(half, 2, axis=0), 2, axis=1)[_inside(box)]


def _inside(box: Box) -> tuple[slice, slice]:
    """The box's rows and columns among the pixels that its half covers."""
    top, left = box.y % 2, box.x % 2
    return slice(top, top + box.height), slice(left, left + box.width)
