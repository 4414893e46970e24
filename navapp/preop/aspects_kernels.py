"""Compiled loops of the aspect graph: contours of a mesh, and points spread evenly."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def find_contour_segments(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    facing: NDArray[np.float64],
    middles: NDArray[np.float64],
    tangents: NDArray[np.float64],
) -> int:
    """Where the surface turns away from a camera: a straight piece in each face that it crosses.

    Args:
        vertices: (V, 3) mm.
        faces: (F, 3).
        facing: (V,) normal times direction to the camera: its zero is the contour.
        middles: (F, 3) in place, middle of each piece.
        tangents: (F, 3) in place, unit, along it.

    Returns:
        How many pieces; only so many rows are written.
    """
    n = 0
    ends = np.empty((2, 3))
    for f in range(faces.shape[0]):
        n_ends = 0
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            if (facing[a] > 0.0) == (facing[b] > 0.0) or n_ends == 2:
                continue
            share = facing[a] / (facing[a] - facing[b])
            for axis in range(3):
                step = vertices[b, axis] - vertices[a, axis]
                ends[n_ends, axis] = vertices[a, axis] + share * step
            n_ends += 1
        if n_ends < 2:
            continue
        length = 0.0
        for axis in range(3):
            length += (ends[1, axis] - ends[0, axis]) ** 2
        length = np.sqrt(length)
        if length < 1e-9:
            continue
        for axis in range(3):
            middles[n, axis] = 0.5 * (ends[0, axis] + ends[1, axis])
            tangents[n, axis] = (ends[1, axis] - ends[0, axis]) / length
        n += 1
    return n


@njit(cache=True, nogil=True)
def select_spread(points: NDArray[np.float64], order: NDArray[np.int64]) -> int:
    """Choose points so that each next one is the furthest from all before it.

    Args:
        points: (N, 3), N > 0.
        order: (n,) in place, indices; the first is point 0.

    Returns:
        How many were chosen: fewer than n when the points run out.
    """
    squared = np.full(points.shape[0], np.inf)
    order[0] = 0
    for k in range(1, order.shape[0]):
        last = order[k - 1]
        furthest, largest = -1, 0.0
        for i in range(points.shape[0]):
            distance = 0.0
            for axis in range(3):
                distance += (points[i, axis] - points[last, axis]) ** 2
            squared[i] = min(squared[i], distance)
            if squared[i] > largest:
                furthest, largest = i, squared[i]
        if furthest < 0:
            return k
        order[k] = furthest
    return int(order.shape[0])
