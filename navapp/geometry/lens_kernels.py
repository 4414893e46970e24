"""Compiled projection through a lens."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# What lies nearer than this is at the camera or behind it.
_LEAST_DEPTH_MM = 1e-6


@njit(cache=True, nogil=True)
def project_through_lens(
    points_mm: NDArray[np.float64],
    matrix: NDArray[np.float64],
    k: NDArray[np.float64],
    pixels: NDArray[np.float64],
) -> None:
    """Pixels of points in a camera's frame; NaN where its lens shows nothing.

    Reference: `geometry.camera.distort`.

    Args:
        points_mm: (N, 3).
        matrix: (3, 3) of the camera.
        k: (14,) coefficients in OpenCV's order, 0 where there are none.
        pixels: (N, 2) in place.
    """
    for n in range(len(points_mm)):
        depth_mm = points_mm[n, 2] if points_mm[n, 2] > _LEAST_DEPTH_MM else np.nan
        x, y = points_mm[n, 0] / depth_mm, points_mm[n, 1] / depth_mm
        r2, xy2 = x * x + y * y, 2.0 * x * y
        below = 1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]))
        above = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))
        radial = above / (below if below > 0.0 else np.nan)
        x_bent = x * radial + k[2] * xy2 + k[3] * (r2 + 2.0 * x * x) + k[8] * r2 + k[9] * r2 * r2
        y_bent = y * radial + k[2] * (r2 + 2.0 * y * y) + k[3] * xy2 + k[10] * r2 + k[11] * r2 * r2
        pixels[n, 0] = matrix[0, 0] * x_bent + matrix[0, 2]
        pixels[n, 1] = matrix[1, 1] * y_bent + matrix[1, 2]
