"""A disc, seen as an ellipse by a sharp and blurred camera.

    I(x) = m + a E(d) + g . (x - c)

with d the distance from the ellipse, outwards, and E the blurred step of a corner's edges. The
disc's centre is not seen at the ellipse's centre: in perspective it is the pole of the board's
horizon (the picture of its line at infinity).
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from calibration.targets.mark_kernels import add_pixel, edge, solve_step

N_PARAMETERS = 10
_MOST_STEPS = 30
_SETTLED_PX = 1e-4
_LEAST_BLUR_PX = 0.15
_FIRST_BLUR_PX = 1.2
_LARGEST_RADIUS_PX = 60.0


@njit(cache=True, nogil=True)
def predict(x: float, y: float, p: NDArray[np.float64], slopes: NDArray[np.float64]) -> float:
    """Grey value of the model at a pixel, and its slopes by the ten parameters.

    Args:
        x: column of a pixel.
        y: its row.
        p: (10,) centre x, y; b11, b12, b22 of the symmetric matrix that maps the ellipse to the
            unit circle; blur; amplitude, mean, gradient x, y.
        slopes: (10,) written.
    """
    dx, dy = x - p[0], y - p[1]
    u, v = p[2] * dx + p[3] * dy, p[3] * dx + p[4] * dy
    rho = max(math.sqrt(u * u + v * v), 1e-6)
    # By the gradient of rho its excess over 1 becomes the distance from the ellipse.
    gx, gy = (p[2] * u + p[3] * v) / rho, (p[3] * u + p[4] * v) / rho
    steepness = max(math.sqrt(gx * gx + gy * gy), 1e-9)
    distance_px = (rho - 1.0) / steepness
    step, slope = edge(distance_px, p[5])
    by_rho = p[6] * slope / steepness
    slopes[0], slopes[1] = -by_rho * gx - p[8], -by_rho * gy - p[9]
    slopes[2] = by_rho * u * dx / rho
    slopes[3] = by_rho * (u * dy + v * dx) / rho
    slopes[4] = by_rho * v * dy / rho
    slopes[5] = -p[6] * slope * distance_px / p[5]
    slopes[6], slopes[7] = step, 1.0
    slopes[8], slopes[9] = dx, dy
    grey: float = p[6] * step + p[7] + p[8] * dx + p[9] * dy
    return grey


@njit(cache=True, nogil=True)
def pole_of_horizon(p: NDArray[np.float64], horizon: NDArray[np.float64]) -> tuple[float, float]:
    """Where the disc's centre is seen.

    Args:
        p: parameters of the ellipse, as `predict` takes them.
        horizon: (3,) line in homogeneous pixels, from the same origin.
    """
    # The conic about its own centre is diag(Q, -1) with Q = B B: its pole of (l, m, k) is
    # (Q^-1 (l, m), -k); the line is moved there first.
    q11, q12 = p[2] * p[2] + p[3] * p[3], p[3] * (p[2] + p[4])
    q22 = p[3] * p[3] + p[4] * p[4]
    determinant = q11 * q22 - q12 * q12
    offset = horizon[0] * p[0] + horizon[1] * p[1] + horizon[2]
    x = (q22 * horizon[0] - q12 * horizon[1]) / determinant
    y = (q11 * horizon[1] - q12 * horizon[0]) / determinant
    return p[0] - x / offset, p[1] - y / offset


@njit(cache=True, nogil=True)
def start_shape(px_from_disc: NDArray[np.float64], p: NDArray[np.float64]) -> float:
    """Set b11, b12, b22 for a disc of radius 1 under a linear map; returns the larger half axis."""
    squared = px_from_disc @ px_from_disc.T
    # Of a 2x2 matrix: S^1/2 = (S + det^1/2 I) / (trace + 2 det^1/2)^1/2; its inverse is wanted.
    root = math.sqrt(max(squared[0, 0] * squared[1, 1] - squared[0, 1] ** 2, 1e-12))
    trace = squared[0, 0] + squared[1, 1]
    scale = math.sqrt(trace + 2.0 * root)
    a, b, d = (squared[0, 0] + root) / scale, squared[0, 1] / scale, (squared[1, 1] + root) / scale
    determinant = a * d - b * b
    p[2], p[3], p[4] = d / determinant, -b / determinant, a / determinant
    return math.sqrt(0.5 * (trace + math.sqrt(max(trace * trace - 4.0 * root * root, 0.0))))


@njit(cache=True, nogil=True)
def fit_circle(
    picture: NDArray[np.uint8],
    centre_px: NDArray[np.float64],
    px_from_disc: NDArray[np.float64],
    reach: float,
    horizon: NDArray[np.float64],
    told: NDArray[np.float64],
) -> None:
    """Fit one disc.

    Args:
        picture: (H, W) grey.
        centre_px: (2,) where it is expected, within about a quarter of its radius.
        px_from_disc: (2, 2) linear map from the disc, of radius 1, to pixels.
        reach: farthest pixel that is looked at, in radii.
        horizon: (3,) the board's line at infinity in homogeneous pixels.
        told: (5,) written: x, y, standard error of one coordinate px, blur px, and contrast (step
            between paper and disc over the rms of what is left). NaN when the fit fails.
    """
    told[:] = np.nan
    p, slopes = np.zeros(N_PARAMETERS), np.empty(N_PARAMETERS)
    radius_px = start_shape(px_from_disc, p)
    x0, y0 = round(centre_px[0]), round(centre_px[1])
    window = math.ceil(reach * radius_px)
    height, width = picture.shape
    if radius_px > _LARGEST_RADIUS_PX or x0 < window or y0 < window:
        return
    if x0 + window >= width or y0 + window >= height:
        return
    p[0], p[1] = centre_px[0] - x0, centre_px[1] - y0
    p[5], p[6] = _FIRST_BLUR_PX, 1.0
    expected = p.copy()
    normal, right = np.empty((N_PARAMETERS, N_PARAMETERS)), np.empty(N_PARAMETERS)
    is_settled, n, squares = False, 0, 0.0
    for number in range(_MOST_STEPS):
        normal[:], right[:] = 0.0, 0.0
        n, squares = 0, 0.0
        for row in range(-window, window + 1):
            for column in range(-window, window + 1):
                dx, dy = column - expected[0], row - expected[1]
                u = expected[2] * dx + expected[3] * dy
                v = expected[3] * dx + expected[4] * dy
                if u * u + v * v > reach * reach:
                    continue
                left = picture[y0 + row, x0 + column] - predict(column, row, p, slopes)
                n += 1
                squares += left * left
                add_pixel(left, slopes, normal, right)
        if n <= 2 * N_PARAMETERS:
            return
        step = solve_step(normal, right, 6, number == 0)
        p += step
        p[5] = max(p[5], _LEAST_BLUR_PX)
        if not (abs(p[0] - expected[0]) < radius_px and abs(p[1] - expected[1]) < radius_px):
            return
        if number > 1 and abs(step[0]) < _SETTLED_PX and abs(step[1]) < _SETTLED_PX:
            is_settled = True
            break
    if not is_settled:
        return
    variance = squares / (n - N_PARAMETERS)
    covariance = np.linalg.inv(normal)
    moved = np.array([horizon[0], horizon[1], horizon[0] * x0 + horizon[1] * y0 + horizon[2]])
    x, y = pole_of_horizon(p, moved)
    told[0], told[1] = x0 + x, y0 + y
    told[2] = math.sqrt(max(0.5 * variance * (covariance[0, 0] + covariance[1, 1]), 0.0))
    told[3] = p[5]
    told[4] = 2.0 * abs(p[6]) / math.sqrt(variance + 1e-12)


@njit(cache=True, nogil=True)
def fit_circles(
    picture: NDArray[np.uint8],
    centres_px: NDArray[np.float64],
    px_from_disc: NDArray[np.float64],
    reach: float,
    horizon: NDArray[np.float64],
    told: NDArray[np.float64],
) -> None:
    """`fit_circle` for all: (N, 2), (N, 2, 2), and (N, 5) written."""
    for k in range(len(centres_px)):
        fit_circle(picture, centres_px[k], px_from_disc[k], reach, horizon, told[k])
