"""Compiled reprojection of a disparity map."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def count_wanted(
    disparity: NDArray[np.float32],
    origin: NDArray[np.uint8],
    is_wanted: NDArray[np.bool_],
    stride: int,
) -> int:
    """How many pixels of a grid have a disparity of a wanted origin; arguments as below."""
    n = 0
    for y in range(0, disparity.shape[0], stride):
        for x in range(0, disparity.shape[1], stride):
            d = disparity[y, x]
            n += is_wanted[origin[y, x]] and d > 0.0 and d < np.inf
    return n


@njit(cache=True, nogil=True)
def reproject_pixels(
    disparity: NDArray[np.float32],
    sigma: NDArray[np.float32],
    origin: NDArray[np.uint8],
    is_wanted: NDArray[np.bool_],
    stride: int,
    place: tuple[int, int],
    camera: tuple[float, float, float, float],
    points: NDArray[np.float64],
    sigma_ray: NDArray[np.float64],
    pixels: NDArray[np.int32],
    origins: NDArray[np.uint8],
) -> None:
    """Points of the pixels of a grid.

    Args:
        disparity: (h, w) px, NaN where unknown.
        sigma: (h, w) px.
        origin: (h, w).
        is_wanted: (256,) by origin.
        stride: rows and columns from point to point.
        place: column and row of the map's first pixel in the picture.
        camera: focal length px, column and row of the axis px, baseline mm.
        points: (N, 3) in place, mm; as many as `count_wanted` says.
        sigma_ray: (N,) in place, mm along the ray.
        pixels: (N, 2) in place, column and row in the picture.
        origins: (N,) in place.
    """
    focal, centre_x, centre_y, baseline = camera
    n = 0
    for row in range(0, disparity.shape[0], stride):
        for column in range(0, disparity.shape[1], stride):
            d = np.float64(disparity[row, column])
            if not (is_wanted[origin[row, column]] and d > 0.0 and d < np.inf):
                continue
            u, v = column + place[0], row + place[1]
            x, y, z = (u - centre_x) / focal, (v - centre_y) / focal, focal * baseline / d
            points[n, 0], points[n, 1], points[n, 2] = x * z, y * z, z
            along = np.sqrt(1.0 + x * x + y * y)
            sigma_ray[n] = z * z / (focal * baseline) * np.float64(sigma[row, column]) * along
            pixels[n, 0], pixels[n, 1] = u, v
            origins[n] = origin[row, column]
            n += 1
