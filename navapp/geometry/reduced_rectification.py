"""Rectified pictures at a part of their resolution: to tell what lies where, not to measure."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bilinear import lens_maps
from navapp.geometry.box import Box
from navapp.geometry.camera import Camera
from navapp.geometry.halves import mean_blocks
from navapp.geometry.rectification import (
    Image,
    RectifiedPair,
    Rectifier,
    find_reached,
    luma,
)
from navapp.geometry.resampling import TAPS_PX
from navapp.geometry.transform import FloatArray


class ReducedRectifier:
    """Reduces pictures, then rectifies them: a fraction of the time of a rectifier.

    Args:
        rectifier: of the whole pictures.
        reduction: rows and columns of a block that becomes one pixel, its mean. A last row or
            column that fills no block is left out.
    """

    def __init__(self, rectifier: Rectifier, reduction: int) -> None:
        self._rectifier, self._reduction = rectifier, reduction
        self.geometry = rectifier.geometry.reduced(reduction)
        rig, (r1, r2, p1, p2) = rectifier.rig, rectifier.matrices
        self._maps = [
            lens_maps(_reduce_camera(camera, reduction), turn, _reduce_matrix(onto, reduction))
            for camera, turn, onto in ((rig.left, r1, p1), (rig.right, r2, p2))
        ]

    def rectify(
        self, left: Image, right: Image, box: Box, band_px: tuple[float, float]
    ) -> RectifiedPair:
        """Both pictures, grey; only what a box reaches, and `TAPS_PX` around: the rest is 0.

        Args:
            left: whole picture of the left camera.
            right: of the right one.
            box: region of interest in the reduced left view; it is passed on clipped.
            band_px: smallest and largest disparity, in reduced pixels.

        Raises:
            ValueError: pictures of another size than the rig's, a grey one beside a coloured one.
        """
        self._rectifier.check(left, right)
        inside = box.clip(self.geometry.width, self.geometry.height)
        parts = find_reached(inside.grow(TAPS_PX), band_px)
        rectified_left, rectified_right = (
            _resample(picture, self._reduction, maps, part)
            for picture, maps, part in zip((left, right), self._maps, parts, strict=True)
        )
        return RectifiedPair(rectified_left, rectified_right, self.geometry, inside)


def _reduce_camera(camera: Camera, reduction: int) -> Camera:
    return replace(
        camera,
        matrix=_reduce_matrix(camera.matrix, reduction),
        width=camera.width // reduction,
        height=camera.height // reduction,
    )


def _reduce_matrix(matrix: FloatArray, reduction: int) -> FloatArray:
    """A camera's matrix (3, n) of pictures whose pixels are means of blocks."""
    shift = 0.5 / reduction - 0.5
    scaling = np.array([[1 / reduction, 0.0, shift], [0.0, 1 / reduction, shift], [0.0, 0.0, 1.0]])
    return np.asarray(scaling @ matrix)


def _resample(
    picture: Image, reduction: int, maps: tuple[NDArray[np.float32], ...], part: Box
) -> Image:
    """A part of the reduced picture at real places (h, w), x and y, linear; 0 beside it."""
    import cv2

    height, width = maps[0].shape
    resampled = np.zeros((height, width), dtype=np.uint8)
    part = part.clip(width, height)
    if part.is_empty:
        return resampled
    x, y = (places[part.slices] for places in maps)
    asked = _box_around(x, y).clip(width, height)
    if not asked.is_empty:
        block = Box(*(reduction * n for n in (asked.x, asked.y, asked.width, asked.height)))
        reduced = mean_blocks(luma(picture[block.slices]), reduction)
        places = x - np.float32(asked.x), y - np.float32(asked.y)
        resampled[part.slices] = cv2.remap(reduced, *places, cv2.INTER_LINEAR)
    return resampled


def _box_around(x: NDArray[np.float32], y: NDArray[np.float32]) -> Box:
    """The pixels between which all places lie."""
    (first_x, last_x), (first_y, last_y) = (
        (math.floor(places.min()), math.ceil(places.max())) for places in (x, y)
    )
    return Box(first_x, first_y, last_x - first_x + 1, last_y - first_y + 1)
