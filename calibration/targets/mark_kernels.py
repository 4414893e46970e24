"""What the fits of corners and of discs share: a blurred step, and Gauss-Newton's step."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

_ROOT_2 = math.sqrt(2.0)
_ROOT_2_OVER_PI = math.sqrt(2.0 / math.pi)


@njit(cache=True, nogil=True)
def edge(distance_px: float, blur_px: float) -> tuple[float, float]:
    """A blurred step from -1 to 1, and its slope per px."""
    z = distance_px / blur_px
    return math.erf(z / _ROOT_2), math.exp(-0.5 * z * z) * _ROOT_2_OVER_PI / blur_px


@njit(cache=True, nogil=True)
def add_pixel(
    left: float,
    slopes: NDArray[np.float64],
    normal: NDArray[np.float64],
    right: NDArray[np.float64],
) -> None:
    """Add one residual to the lower half of the normal equations."""
    for i in range(len(slopes)):
        right[i] += slopes[i] * left
        for j in range(i + 1):
            normal[i, j] += slopes[i] * slopes[j]


@njit(cache=True, nogil=True)
def solve_step(
    normal: NDArray[np.float64], right: NDArray[np.float64], n_shape: int, is_first: bool
) -> NDArray[np.float64]:
    """Gauss-Newton's step; the first finds light and contrast alone: the shape stands on them."""
    for i in range(len(right)):
        normal[i, i] += 1e-9 * (1.0 + normal[i, i])
        for j in range(i):
            if is_first and j < n_shape <= i:
                normal[i, j] = 0.0
            normal[j, i] = normal[i, j]
    step = np.empty(len(right))
    step[:] = np.linalg.solve(normal, right)
    if is_first:
        step[:n_shape] = 0.0
    return step
