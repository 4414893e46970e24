"""Compiled motion of points by a pose, and their mean displacement between two."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Place = tuple[float, float, float]


@njit(cache=True, nogil=True)
def rotate(R: NDArray[np.float64], vectors: NDArray[np.float64], i: int) -> Place:
    """Vector i of (N, 3) after a rotation (3, 3)."""
    x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@njit(cache=True, nogil=True)
def move_point(
    R: NDArray[np.float64], t: NDArray[np.float64], points: NDArray[np.float64], i: int
) -> Place:
    """Point i of (N, 3) after a rotation (3, 3) and a translation (3,)."""
    x, y, z = rotate(R, points, i)
    return x + t[0], y + t[1], z + t[2]


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
        dx, dy, dz = move_point(turned, shifted, points, i)
        total += math.sqrt(dx * dx + dy * dy + dz * dz)
    return total / points.shape[0] if points.shape[0] > 0 else math.nan
