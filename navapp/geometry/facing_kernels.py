"""Compiled test of which side of a surface an eye sees."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def faces(
    camera: NDArray[np.float64],
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    v: int,
    least_cosine: float,
) -> bool:
    """Whether vertex v shows its outer side to a camera, both in bone coordinates."""
    dx, dy, dz = camera[0] - points[v, 0], camera[1] - points[v, 1], camera[2] - points[v, 2]
    towards = normals[v, 0] * dx + normals[v, 1] * dy + normals[v, 2] * dz
    if least_cosine == 0.0:  # most calls, and no root needed
        return bool(towards >= 0.0)
    seen: bool = towards >= least_cosine * np.sqrt(dx * dx + dy * dy + dz * dz)
    return seen


@njit(cache=True, nogil=True)
def find_facing(
    camera: NDArray[np.float64],
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    least_cosine: float,
    is_facing: NDArray[np.bool_],
) -> None:
    """Which vertices show their outer side to a camera.

    Args:
        camera: (3,) mm.
        points: (V, 3) mm.
        normals: (V, 3) unit.
        least_cosine: of the angle between normal and line of sight.
        is_facing: (V,) in place.
    """
    for v in range(points.shape[0]):
        is_facing[v] = faces(camera, points, normals, v, least_cosine)
