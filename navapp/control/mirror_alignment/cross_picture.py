"""The picture with one cross that the display shows."""

import numpy as np
from numpy.typing import NDArray

# Thin, so that it is aligned to a pixel; its ends thick, so that it is found.
_ARM_PX, _THICK_FROM_PX, _HALF_THICK_PX = 24, 12, 1
_BGR = (80, 255, 80)


def draw_cross(width_px: int, height_px: int, pixel: tuple[int, int]) -> NDArray[np.uint8]:
    """(height, width, 3) BGR, black but for the cross with its middle in a pixel."""
    picture = np.zeros((height_px, width_px, 3), np.uint8)
    u, v = pixel
    arms = ((0, _ARM_PX, 0), (_THICK_FROM_PX, _ARM_PX, _HALF_THICK_PX))
    for first, last, half in arms:
        for sign in (-1, 1):
            along = sorted((sign * first, sign * last))
            _light(picture, (u + along[0], u + along[1]), (v - half, v + half))
            _light(picture, (u - half, u + half), (v + along[0], v + along[1]))
    return picture


def _light(picture: NDArray[np.uint8], columns: tuple[int, int], rows: tuple[int, int]) -> None:
    top, left = max(rows[0], 0), max(columns[0], 0)
    picture[top : max(rows[1] + 1, 0), left : max(columns[1] + 1, 0)] = _BGR
