"""Compiled look-up of the nearest model vertex."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def nearest_vertices(
    points_mm: NDArray[np.float64],
    vertices_mm: NDArray[np.float64],
    neighbours: NDArray[np.int32],
    grid: NDArray[np.int32],
    grid_origin_mm: NDArray[np.float64],
    spacing_mm: float,
    index: NDArray[np.int32],
    distance_mm: NDArray[np.float64],
) -> None:
    """Nearest vertex of each point: the grid's answer, then descent along the mesh.

    Args:
        points_mm: (N, 3).
        vertices_mm: (V, 3).
        neighbours: (V, K) vertices that share an edge, -1 padded.
        grid: (nx, ny, nz) nearest vertex of each voxel's centre.
        grid_origin_mm: (3,) centre of voxel (0, 0, 0).
        spacing_mm: of the voxels.
        index: (N,) in place; -1 outside the grid.
        distance_mm: (N,) in place; infinite outside the grid.
    """
    for i in range(points_mm.shape[0]):
        x, y, z = points_mm[i, 0], points_mm[i, 1], points_mm[i, 2]
        gx = int(np.floor((x - grid_origin_mm[0]) / spacing_mm + 0.5))
        gy = int(np.floor((y - grid_origin_mm[1]) / spacing_mm + 0.5))
        gz = int(np.floor((z - grid_origin_mm[2]) / spacing_mm + 0.5))
        if (
            gx < 0 or gy < 0 or gz < 0
            or gx >= grid.shape[0] or gy >= grid.shape[1] or gz >= grid.shape[2]
        ):  # fmt: skip
            index[i] = -1
            distance_mm[i] = np.inf
            continue
        best = grid[gx, gy, gz]
        dx, dy, dz = x - vertices_mm[best, 0], y - vertices_mm[best, 1], z - vertices_mm[best, 2]
        least = dx * dx + dy * dy + dz * dz
        moved = True
        while moved:
            moved = False
            start = best
            for k in range(neighbours.shape[1]):
                other = neighbours[start, k]
                if other < 0:
                    break
                dx = x - vertices_mm[other, 0]
                dy = y - vertices_mm[other, 1]
                dz = z - vertices_mm[other, 2]
                squared = dx * dx + dy * dy + dz * dz
                if squared < least:
                    least = squared
                    best = other
                    moved = True
        index[i] = best
        distance_mm[i] = np.sqrt(least)
