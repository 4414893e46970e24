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

from calibration.targets.mark_kernels import (
    FIRST_BLUR_PX,
    MOST_STEPS,
    add_pixel,
    compute_edge,
    has_settled,
    tell,
)

N_PARAMETERS, _N_SHAPE = 9, 5


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
    step_1, slope_1 = compute_edge(d1, p[4])
    step_2, slope_2 = compute_edge(d2, p[4])
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
def find_clear_pixels(
    corner_px: NDArray[np.float64],
    board_from_px: NDArray[np.float64],
    limits: tuple[float, float, float],
) -> NDArray[np.int64]:
    """(n, 2) columns and rows of the pixels around a corner that show nothing but its squares.

    Args:
        corner_px: (2,) where it is expected.
        board_from_px: (2, 2) linear map to units of the board.
        limits: as `is_clear` takes them.
    """
    radius = int(limits[0])
    x0, y0 = round(corner_px[0]), round(corner_px[1])
    pixels = np.empty(((2 * radius + 1) ** 2, 2), dtype=np.int64)
    n = 0
    for y in range(y0 - radius, y0 + radius + 1):
        for x in range(x0 - radius, x0 + radius + 1):
            if is_clear(x - corner_px[0], y - corner_px[1], board_from_px, limits):
                pixels[n, 0], pixels[n, 1] = x, y
                n += 1
    return pixels[:n]


@njit(cache=True, nogil=True)
def invert(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a regular (2, 2) matrix."""
    determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    inverse = np.empty((2, 2))
    inverse[0, 0], inverse[0, 1] = matrix[1, 1] / determinant, -matrix[0, 1] / determinant
    inverse[1, 0], inverse[1, 1] = -matrix[1, 0] / determinant, matrix[0, 0] / determinant
    return inverse


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
        told: (5,) written as `tell` does; NaN when the fit fails.
    """
    told[:] = np.nan
    radius = int(limits[0])
    x0, y0 = round(corner_px[0]), round(corner_px[1])
    height, width = picture.shape
    if x0 < radius or y0 < radius or x0 + radius >= width or y0 + radius >= height:
        return
    pixels = find_clear_pixels(corner_px, invert(px_from_board), limits)
    n = len(pixels)
    if n <= 2 * N_PARAMETERS:
        return
    # From the corner's own pixel: the gradient's origin is not far from what it turns about.
    p, slopes = np.zeros(N_PARAMETERS), np.empty(N_PARAMETERS)
    p[0], p[1] = corner_px[0] - x0, corner_px[1] - y0
    p[2] = math.atan2(px_from_board[1, 0], px_from_board[0, 0])
    p[3] = math.atan2(px_from_board[1, 1], px_from_board[0, 1])
    p[4], p[5] = FIRST_BLUR_PX, 1.0
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
        if not off < limits[0]:
            return
        if rests:
            tell(x0 + p[0], y0 + p[1], p, _N_SHAPE, squares / (n - N_PARAMETERS), normal, told)
            return


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
