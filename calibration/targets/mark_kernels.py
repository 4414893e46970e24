"""What the fits of corners and of discs share: a blurred step, and Gauss-Newton's steps.

Parameters are the mark's place x and y, its shape, the blur last of it; then amplitude, mean and
the gradient along x and y: `n_shape` of them come before the amplitude.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Of every mark is told: x, y, standard error of one coordinate px, blur px, and contrast (step
# between black and white over the rms of what is left).
N_TOLD = 5
MOST_STEPS = 30
FIRST_BLUR_PX, _LEAST_BLUR_PX = 1.2, 0.15
_SETTLED_PX = 1e-4
_ROOT_2 = math.sqrt(2.0)
_ROOT_2_OVER_PI = math.sqrt(2.0 / math.pi)


@njit(cache=True, nogil=True)
def compute_edge(distance_px: float, blur_px: float) -> tuple[float, float]:
    """A blurred step from -1 to 1, and its slope per px."""
    z = distance_px / blur_px
    return math.erf(z / _ROOT_2), math.exp(-0.5 * z * z) * _ROOT_2_OVER_PI / blur_px


@njit(cache=True, nogil=True)
def add_pixel(
    residual: float,
    slopes: NDArray[np.float64],
    normal: NDArray[np.float64],
    right: NDArray[np.float64],
) -> None:
    """Add one residual to the lower half of the normal equations."""
    for i in range(len(slopes)):
        right[i] += slopes[i] * residual
        for j in range(i + 1):
            normal[i, j] += slopes[i] * slopes[j]


@njit(cache=True, nogil=True)
def factorise(normal: NDArray[np.float64]) -> None:
    """Cholesky's factor L of normal equations, in the place of their lower half.

    Ours, because numba compiles LAPACK's for seconds. NaN when they are not positive definite.
    """
    for i in range(len(normal)):
        for j in range(i + 1):
            rest = normal[i, j]
            for k in range(j):
                rest -= normal[i, k] * normal[j, k]
            if i > j:
                normal[i, j] = rest / normal[j, j]
            else:
                normal[i, i] = math.sqrt(rest) if rest > 0.0 else math.nan


@njit(cache=True, nogil=True)
def solve_factorised(factor: NDArray[np.float64], right: NDArray[np.float64]) -> None:
    """Solve L L^T x = right, in place; L as `factorise` leaves it."""
    n = len(right)
    for i in range(n):
        for k in range(i):
            right[i] -= factor[i, k] * right[k]
        right[i] /= factor[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= factor[k, i] * right[k]
        right[i] /= factor[i, i]


@njit(cache=True, nogil=True)
def solve_step(
    normal: NDArray[np.float64], right: NDArray[np.float64], n_shape: int, is_first: bool
) -> None:
    """Gauss-Newton's step in the place of the right side, Cholesky's factor in that of the other.

    The first step finds light and contrast alone: the shape stands on them.
    """
    for i in range(len(right)):
        normal[i, i] += 1e-9 * (1.0 + normal[i, i])
        for j in range(i):
            if is_first and j < n_shape <= i:
                normal[i, j] = 0.0
    factorise(normal)
    solve_factorised(normal, right)
    if is_first:
        right[:n_shape] = 0.0


@njit(cache=True, nogil=True)
def has_settled(
    p: NDArray[np.float64],
    normal: NDArray[np.float64],
    right: NDArray[np.float64],
    n_shape: int,
    number: int,
) -> bool:
    """Take a step; whether the mark rests.

    Args:
        p: parameters, in place.
        normal: (n, n) lower half of the normal equations; their factor takes its place.
        right: (n,) their right side; the step takes its place.
        n_shape: parameters before the amplitude.
        number: of the step, from 0.
    """
    solve_step(normal, right, n_shape, number == 0)
    p += right
    p[n_shape - 1] = max(p[n_shape - 1], _LEAST_BLUR_PX)
    rests: bool = number > 1 and abs(right[0]) < _SETTLED_PX and abs(right[1]) < _SETTLED_PX
    return rests


@njit(cache=True, nogil=True)
def tell(
    x: float,
    y: float,
    p: NDArray[np.float64],
    n_shape: int,
    variance: float,
    factor: NDArray[np.float64],
    told: NDArray[np.float64],
) -> None:
    """Write what is told of a mark.

    Args:
        x: of the mark, px.
        y: of the mark, px.
        p: parameters.
        n_shape: of them, before the amplitude.
        variance: of what is left of a pixel.
        factor: (n, n) of the normal equations, as `factorise` leaves it.
        told: (5,) written.
    """
    trace = 0.0
    for i in range(2):
        column = np.zeros(len(p))
        column[i] = 1.0
        solve_factorised(factor, column)
        trace += column[i]
    told[0], told[1] = x, y
    told[2] = math.sqrt(0.5 * variance * trace)
    told[3] = p[n_shape - 1]
    told[4] = 2.0 * abs(p[n_shape]) / math.sqrt(variance + 1e-12)
