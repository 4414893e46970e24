"""Compiled drawing of measured points as another camera sees them."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.overlay.see_kernels import Measured, look_up

KNOWN, IN_FRONT = 1, 2


@njit(cache=True, nogil=True)
def splat_points(
    around: Measured,
    finer: Measured,
    is_in_front: NDArray[np.bool_],
    grid: tuple[int, int, int],
    pair: tuple[float, float, float, float],
    eye_from_rectified: NDArray[np.float64],
    eye: tuple[float, float, float, float],
    depth_mm: NDArray[np.float32],
    mark: NDArray[np.uint8],
) -> None:
    """Draw measured points as squares that leave no gap on a surface; the nearest one wins.

    Args:
        around: what lies around the bone.
        finer: what holds instead where it is matched.
        is_in_front: (h, w) marks of what hides the bone.
        grid: column and row of the marks' first pixel in the rectified picture, and of how many
            pixels one is drawn, each way.
        pair: focal length px, column and row of the axis px, baseline mm of the rectified pair.
        eye_from_rectified: (3, 4).
        eye: focal lengths px, column and row of the axis px in the picture drawn.
        depth_mm: (H, W) in place, along the eye's axis; NaN before.
        mark: (H, W) in place, bits `KNOWN` (matched) and `IN_FRONT`.
    """
    focal, centre_x, centre_y, baseline = pair
    step = grid[2]
    for j in range(0, is_in_front.shape[0], step):
        for i in range(0, is_in_front.shape[1], step):
            d, is_matched = look_up(grid[0] + i, grid[1] + j, finer)
            if not is_matched:
                d, is_matched = look_up(grid[0] + i, grid[1] + j, around)
            if not d > 0.0:
                continue
            z = focal * baseline / d
            x = (grid[0] + i - centre_x) / focal * z
            y = (grid[1] + j - centre_y) / focal * z
            m = eye_from_rectified
            ex = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]
            ey = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]
            ez = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]
            if ez < 1.0:
                continue
            u, v = eye[0] * ex / ez + eye[2], eye[1] * ey / ez + eye[3]
            # As large as the gap to the next point, and half as much for slanted surfaces.
            half = 0.75 * step * z / focal * eye[0] / ez
            bits = (KNOWN if is_matched else 0) | (IN_FRONT if is_in_front[j, i] else 0)
            first_row, last_row = max(0, int(np.ceil(v - half))), int(np.floor(v + half))
            first_column, last_column = max(0, int(np.ceil(u - half))), int(np.floor(u + half))
            for row in range(first_row, min(last_row + 1, depth_mm.shape[0])):
                for column in range(first_column, min(last_column + 1, depth_mm.shape[1])):
                    if not depth_mm[row, column] <= ez:
                        depth_mm[row, column] = np.float32(ez)
                        mark[row, column] = bits
