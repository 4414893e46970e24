"""A corner between four squares, as a sharp and blurred camera shows it.

    I(x) = m + a E(d1) E(d2) + g . (x - c),   E(d) = erf(d / (sqrt(2) s))

with d1, d2 the signed distances from two lines through the corner c and s the blur. All nine
numbers are fitted to the pixels of the four squares (Gauss-Newton). OpenCV's cornerSubPix uses the
directions of gradients in a small window alone; the whole edges tell several times as much.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from calibration.targets.mark_kernels import add_pixel, edge, solve_step

N_PARAMETERS = 9
N_TOLD = 5
_MOST_STEPS = 25
_SETTLED_PX = 1e-4
_LEAST_BLUR_PX = 0.15
_FIRST_BLUR_PX = 1.2


@njit(cache=True, nogil=True)
def predict(x: float, y: float, p: NDArray[np.float64], slopes: NDArray[np.float64]) -> float:
    """Grey value of the model at a pixel, and its slopes by the nine parameters.

    Args:
        x: column of a pixel, from the expected corner.
        y: its row.
        p: (9,) corner x, y, directions of both lines in rad, blur; amplitude, mean, gradient x, y.
        slopes: (9,) written.
    """
    dx, dy = x - p[0], y - p[1]
    sine_1, cosine_1 = math.sin(p[2]), math.cos(p[2])
    sine_2, cosine_2 = math.sin(p[3]), math.cos(p[3])
    d1, d2 = -sine_1 * dx + cosine_1 * dy, -sine_2 * dx + cosine_2 * dy
    step_1, slope_1 = edge(d1, p[4])
    step_2, slope_2 = edge(d2, p[4])
    by_1, by_2 = p[5] * slope_1 * step_2, p[5] * step_1 * slope_2
    slopes[0] = by_1 * sine_1 + by_2 * sine_2
    slopes[1] = -by_1 * cosine_1 - by_2 * cosine_2
    slopes[2] = -by_1 * (cosine_1 * dx + sine_1 * dy)
    slopes[3] = -by_2 * (cosine_2 * dx + sine_2 * dy)
    slopes[4] = -(by_1 * d1 + by_2 * d2) / p[4]
    slopes[5], slopes[6] = step_1 * step_2, 1.0
    slopes[7], slopes[8] = x, y
    grey: float = p[5] * step_1 * step_2 + p[6] + p[7] * x + p[8] * y
    return grey


@njit(cache=True, nogil=True)
def is_clear(
    x: float, y: float, board_from_px: NDArray[np.float64], limits: tuple[float, float, float]
) -> bool:
    """Whether a pixel shows nothing but the corner's four squares.

    Args:
        x: column of a pixel, from the corner.
        y: its row.
        board_from_px: (2, 2) linear map to units of the board.
        limits: radius px; farthest from the corner, and from the nearer of its edges, on the board.
    """
    if x * x + y * y > limits[0] * limits[0]:
        return False
    u = abs(board_from_px[0, 0] * x + board_from_px[0, 1] * y)
    v = abs(board_from_px[1, 0] * x + board_from_px[1, 1] * y)
    is_near: bool = max(u, v) < limits[1] and min(u, v) < limits[2]
    return is_near


@njit(cache=True, nogil=True)
def fit_corner(
    picture: NDArray[np.uint8],
    corner_px: NDArray[np.float64],
    px_from_board: NDArray[np.float64],
    limits: tuple[float, float, float],
    told: NDArray[np.float64],
) -> None:
    """Fit one corner.

    Args:
        picture: (H, W) grey.
        corner_px: (2,) where it is expected, within about 2 px.
        px_from_board: (2, 2) linear map from the board around it; its columns are the edges.
        limits: as `is_clear` takes them.
        told: (5,) written: x, y, standard error of one coordinate px, blur px, and contrast (step
            between black and white over the rms of what is left). NaN when the fit fails.
    """
    told[:] = np.nan
    radius = int(limits[0])
    x0, y0 = round(corner_px[0]), round(corner_px[1])
    height, width = picture.shape
    if x0 < radius or y0 < radius or x0 + radius >= width or y0 + radius >= height:
        return
    board_from_px = np.linalg.inv(px_from_board)
    p = np.zeros(N_PARAMETERS)
    p[0], p[1] = corner_px[0] - x0, corner_px[1] - y0
    p[2] = math.atan2(px_from_board[1, 0], px_from_board[0, 0])
    p[3] = math.atan2(px_from_board[1, 1], px_from_board[0, 1])
    p[4], p[5] = _FIRST_BLUR_PX, 1.0
    first = p[:2].copy()
    slopes = np.empty(N_PARAMETERS)
    normal, right = np.empty((N_PARAMETERS, N_PARAMETERS)), np.empty(N_PARAMETERS)
    is_settled = False
    n, squares = 0, 0.0
    for number in range(_MOST_STEPS):
        normal[:], right[:] = 0.0, 0.0
        n, squares = 0, 0.0
        for row in range(-radius, radius + 1):
            for column in range(-radius, radius + 1):
                if not is_clear(column - first[0], row - first[1], board_from_px, limits):
                    continue
                left = picture[y0 + row, x0 + column] - predict(column, row, p, slopes)
                n += 1
                squares += left * left
                add_pixel(left, slopes, normal, right)
        if n <= 2 * N_PARAMETERS:
            return
        step = solve_step(normal, right, 5, number == 0)
        p += step
        p[4] = max(p[4], _LEAST_BLUR_PX)
        if not (abs(p[0] - first[0]) < limits[0] and abs(p[1] - first[1]) < limits[0]):
            return
        if number > 1 and abs(step[0]) < _SETTLED_PX and abs(step[1]) < _SETTLED_PX:
            is_settled = True
            break
    if not is_settled:
        return
    variance = squares / (n - N_PARAMETERS)
    covariance = np.linalg.inv(normal)
    told[0], told[1] = x0 + p[0], y0 + p[1]
    told[2] = math.sqrt(max(0.5 * variance * (covariance[0, 0] + covariance[1, 1]), 0.0))
    told[3] = p[4]
    told[4] = 2.0 * abs(p[5]) / math.sqrt(variance + 1e-12)


@njit(cache=True, nogil=True)
def fit_corners(
    picture: NDArray[np.uint8],
    corners_px: NDArray[np.float64],
    px_from_board: NDArray[np.float64],
    limits: NDArray[np.float64],
    told: NDArray[np.float64],
) -> None:
    """`fit_corner` for all: (N, 2), (N, 2, 2), (N, 3), and (N, 5) written."""
    for k in range(len(corners_px)):
        bounds = (limits[k, 0], limits[k, 1], limits[k, 2])
        fit_corner(picture, corners_px[k], px_from_board[k], bounds, told[k])
