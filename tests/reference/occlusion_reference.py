"""What the right camera sees of a surface known in the left view, pixel by pixel."""

import math

import numpy as np
from numpy.typing import NDArray


def seen_from_right_reference(
    left_px: NDArray[np.float32], left_x: int, picture_width: int
) -> NDArray[np.float32]:
    """(h, W): of all left pixels that fall on a right pixel the nearest one's disparity."""
    height, width = left_px.shape
    right_px = np.full((height, picture_width), np.nan, dtype=np.float32)
    for y in range(height):
        for u in range(picture_width):
            falls_here = [
                left_px[y, x]
                for x in range(width)
                if np.isfinite(left_px[y, x])
                and math.floor(left_x + x - float(left_px[y, x]) + 0.5) == u
            ]
            if falls_here:
                right_px[y, u] = max(falls_here)
    return right_px
