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

from calibration.targets.mark_kernels import (
    FIRST_BLUR_PX,
    MOST_STEPS,
    add_pixel,
    compute_edge,
    has_settled,
    tell,
)

N_PARAMETERS, _N_SHAPE = 10, 6
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
    step, slope = compute_edge(distance_px, p[5])
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
def find_pole(p: NDArray[np.float64], horizon: NDArray[np.float64]) -> tuple[float, float]:
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
    m11, m12, m21, m22 = (
        px_from_disc[0, 0],
        px_from_disc[0, 1],
        px_from_disc[1, 0],
        px_from_disc[1, 1],
    )
    s11, s12, s22 = m11 * m11 + m12 * m12, m11 * m21 + m12 * m22, m21 * m21 + m22 * m22
    # Of S = M M^T: S^1/2 = (S + det^1/2 I) / (trace + 2 det^1/2)^1/2; its inverse is wanted.
    root, trace = math.sqrt(max(s11 * s22 - s12 * s12, 1e-12)), s11 + s22
    scale = math.sqrt(trace + 2.0 * root)
    a, b, d = (s11 + root) / scale, s12 / scale, (s22 + root) / scale
    determinant = a * d - b * b
    p[2], p[3], p[4] = d / determinant, -b / determinant, a / determinant
    return math.sqrt(0.5 * (trace + math.sqrt(max(trace * trace - 4.0 * root * root, 0.0))))


@njit(cache=True, nogil=True)
def find_near_pixels(
    centre_px: NDArray[np.float64], p: NDArray[np.float64], reach: float, radius_px: float
) -> NDArray[np.int64]:
    """(n, 2) columns and rows of the pixels around a disc.

    Args:
        centre_px: (2,) where it is expected.
        p: parameters; its shape is read.
        reach: farthest pixel, in radii.
        radius_px: larger half axis.
    """
    window = math.ceil(reach * radius_px)
    x0, y0 = round(centre_px[0]), round(centre_px[1])
    pixels = np.empty(((2 * window + 1) ** 2, 2), dtype=np.int64)
    n = 0
    for y in range(y0 - window, y0 + window + 1):
        for x in range(x0 - window, x0 + window + 1):
            dx, dy = x - centre_px[0], y - centre_px[1]
            u, v = p[2] * dx + p[3] * dy, p[3] * dx + p[4] * dy
            if u * u + v * v <= reach * reach:
                pixels[n, 0], pixels[n, 1] = x, y
                n += 1
    return pixels[:n]


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
        told: (5,) written as `tell` does; NaN when the fit fails.
    """
    told[:] = np.nan
    p, slopes = np.zeros(N_PARAMETERS), np.empty(N_PARAMETERS)
    radius_px = start_shape(px_from_disc, p)
    window = math.ceil(reach * radius_px)
    x0, y0 = round(centre_px[0]), round(centre_px[1])
    height, width = picture.shape
    is_inside = min(x0, y0) >= window and x0 + window < width and y0 + window < height
    if radius_px > _LARGEST_RADIUS_PX or not is_inside:
        return
    pixels = find_near_pixels(centre_px, p, reach, radius_px)
    n = len(pixels)
    if n <= 2 * N_PARAMETERS:
        return
    p[0], p[1] = centre_px[0] - x0, centre_px[1] - y0
    p[5], p[6] = FIRST_BLUR_PX, 1.0
    expected = p.copy()
    normal, right = np.empty((N_PARAMETERS, N_PARAMETERS)), np.empty(N_PARAMETERS)
    for number in range(MOST_STEPS):
        normal[:], right[:], squares = 0.0, 0.0, 0.0
        for k in range(n):
            x, y = pixels[k, 0], pixels[k, 1]
            residual = picture[y, x] - predict(x - x0, y - y0, p, slopes)
            squares += residual * residual
            add_pixel(residual, slopes, normal, right)
        rests = has_settled(p, normal, right, _N_SHAPE, number)
        off = max(abs(p[0] - expected[0]), abs(p[1] - expected[1]))
        if not off < radius_px:
            return
        if rests:
            shift = horizon[0] * x0 + horizon[1] * y0 + horizon[2]
            u, v = find_pole(p, np.array([horizon[0], horizon[1], shift]))
            tell(x0 + u, y0 + v, p, _N_SHAPE, squares / (n - N_PARAMETERS), normal, told)
            return


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
