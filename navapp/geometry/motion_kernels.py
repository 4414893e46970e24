"""Compiled mean displacement of points between two poses."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def find_mean_motion(
    turned: NDArray[np.float64], shifted: NDArray[np.float64], points: NDArray[np.float64]
) -> float:
    """Mean length of `turned @ p + shifted` over points p; NaN without any.

    Args:
        turned: (3, 3) difference of the two rotations.
        shifted: (3,) difference of the two translations.
        points: (N, 3).
    """
    total = 0.0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        dx = turned[0, 0] * x + turned[0, 1] * y + turned[0, 2] * z + shifted[0]
        dy = turned[1, 0] * x + turned[1, 1] * y + turned[1, 2] * z + shifted[1]
        dz = turned[2, 0] * x + turned[2, 1] * y + turned[2, 2] * z + shifted[2]
        total += math.sqrt(dx * dx + dy * dy + dz * dz)
    return total / points.shape[0] if points.shape[0] > 0 else math.nan
