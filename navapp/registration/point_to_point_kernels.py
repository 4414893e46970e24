"""Compiled pairs of nearest points, and the sums from which a rigid motion is solved."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.motion_kernels import move_point
from navapp.geometry.transform import FloatArray
from navapp.registration.lookup_kernels import (
    VoxelGrid,
    find_vertex,
    find_voxel,
    squared_distance,
)
from navapp.registration.pairing_kernels import Pose

# A pair further apart than so many widths of the kernel weighs less than 4e-6: it is left out.
_REACH_WIDTHS = 5.0


class PointSet(NamedTuple):
    """Points among which the nearest is looked up; mm, in their own frame."""

    points: FloatArray  # (N, 3)
    neighbours: NDArray[np.int32]  # (N, K) points beside each point, -1 padded
    grid: VoxelGrid  # of nearest points; no voxel is without one


@njit(cache=True, nogil=True)
def sum_pairs(
    moving: PointSet,
    fixed: PointSet,
    pose: Pose,
    sigma_mm: float,
    first: int,
    step: int,
    distance_mm: FloatArray,
    sums: FloatArray,
) -> None:
    """Pair every n-th point with its nearest one, weigh the pair, add it to the sums.

    Args:
        moving: a of the pairs.
        fixed: among which the nearest, b, is looked up.
        pose: fixed from moving.
        sigma_mm: width of the kernel exp(-d^2 / (2 sigma^2)); infinite: every pair weighs 1.
        first: first point.
        step: to the next one.
        distance_mm: (N,) of the pairs, in place; of one out of the kernel's reach, at least that.
        sums: (4, 4) of w [a; 1] [b; 1]^T, in place.
    """
    points, places, grid = moving.points, fixed.points, fixed.grid
    nx, ny, nz = grid.nearest.shape
    # The nearest point is at most a voxel's diagonal nearer than the one of the voxel.
    reach_mm = _REACH_WIDTHS * sigma_mm + np.sqrt(3.0) * grid.voxel
    per_mm2 = 0.5 / (sigma_mm * sigma_mm)
    for i in range(first, points.shape[0], step):
        x, y, z = move_point(pose.rotation, pose.translation, points, i)
        ix, iy, iz = find_voxel(x, y, z, grid)
        ix, iy, iz = min(max(ix, 0), nx - 1), min(max(iy, 0), ny - 1), min(max(iz, 0), nz - 1)
        distance_mm[i] = np.sqrt(squared_distance(x, y, z, places, grid.nearest[ix, iy, iz]))
        if distance_mm[i] > reach_mm:
            continue
        v = find_vertex(x, y, z, places, fixed.neighbours, grid)
        squared = squared_distance(x, y, z, places, v)
        distance_mm[i] = np.sqrt(squared)
        weight = np.exp(-per_mm2 * squared)
        sums[3, 3] += weight
        for k in range(3):
            sums[k, 3] += weight * points[i, k]
            sums[3, k] += weight * places[v, k]
            for j in range(3):
                sums[k, j] += weight * points[i, k] * places[v, j]
