"""Compiled look-ups: the nearest vertex of a model, the nearest point of a scene.

The model does not change: a grid of nearest vertices is made once. A scene is new with every frame:
its grid is made by handing points on, which costs less than a tree.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class ModelArrays(NamedTuple):
    """A model as the kernels read it; lengths in mm, bone coordinates.

    Attributes:
        points: (V, 3) of the surface.
        normals: (V, 3) unit, outward.
        curvature: (V, 6) how the normal turns along the surface: xx, yy, zz, xy, xz, yz of a
            symmetric matrix, 1/mm.
        spacing: (V,) mean distance to the neighbours.
        sigma: (V,) of the surface along the normal.
        can_pair: (V,) False at open borders and where a stage has cut.
        neighbours: (V, K) vertices beside each vertex, -1 padded.
        grid: (nx, ny, nz) nearest vertex of each voxel's centre.
        origin: (3,) centre of voxel (0, 0, 0).
        voxel: edge of the voxels.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    curvature: NDArray[np.float64]
    spacing: NDArray[np.float64]
    sigma: NDArray[np.float64]
    can_pair: NDArray[np.bool_]
    neighbours: NDArray[np.int32]
    grid: NDArray[np.int32]
    origin: NDArray[np.float64]
    voxel: float


class SceneGrid(NamedTuple):
    """Which scene point is near each place; lengths in mm, scene coordinates.

    Attributes:
        nearest: (nx, ny, nz) a point near each voxel's centre, the nearest or almost; -1 without.
        origin: (3,) centre of voxel (0, 0, 0).
        voxel: edge of the voxels.
    """

    nearest: NDArray[np.int32]
    origin: NDArray[np.float64]
    voxel: float


@njit(cache=True, nogil=True)
def nearest_vertex(
    x: float,
    y: float,
    z: float,
    points: NDArray[np.float64],
    neighbours: NDArray[np.int32],
    grid: NDArray[np.int32],
    origin: NDArray[np.float64],
    voxel: float,
) -> int:
    """Nearest vertex of a point: the answer of the grid's nearest voxel, then descent.

    The arrays are those of `ModelArrays`, one by one: handing over the whole tuple at every point
    costs as much as the look-up.
    """
    nx, ny, nz = grid.shape
    gx = int(np.floor((x - origin[0]) / voxel + 0.5))
    gy = int(np.floor((y - origin[1]) / voxel + 0.5))
    gz = int(np.floor((z - origin[2]) / voxel + 0.5))
    best: int = grid[min(max(gx, 0), nx - 1), min(max(gy, 0), ny - 1), min(max(gz, 0), nz - 1)]
    dx, dy, dz = x - points[best, 0], y - points[best, 1], z - points[best, 2]
    least = dx * dx + dy * dy + dz * dz
    start = -1
    while start != best:
        start = best
        for k in range(neighbours.shape[1]):
            other = neighbours[start, k]
            if other < 0:
                break
            dx, dy, dz = x - points[other, 0], y - points[other, 1], z - points[other, 2]
            squared = dx * dx + dy * dy + dz * dz
            if squared < least:
                least = squared
                best = other
    return best


@njit(cache=True, nogil=True)
def nearest_vertices(
    points_mm: NDArray[np.float64],
    model: ModelArrays,
    index: NDArray[np.int32],
    distance_mm: NDArray[np.float64],
) -> None:
    """Nearest vertex of each point.

    Args:
        points_mm: (N, 3) in bone coordinates.
        model: prepared.
        index: (N,) in place.
        distance_mm: (N,) in place.
    """
    for i in range(points_mm.shape[0]):
        x, y, z = points_mm[i, 0], points_mm[i, 1], points_mm[i, 2]
        best = nearest_vertex(
            x, y, z, model.points, model.neighbours, model.grid, model.origin, model.voxel
        )
        dx, dy, dz = (
            x - model.points[best, 0], y - model.points[best, 1], z - model.points[best, 2],
        )  # fmt: skip
        index[i] = best
        distance_mm[i] = np.sqrt(dx * dx + dy * dy + dz * dz)


@njit(cache=True, nogil=True)
def fill_scene_grid(points_mm: NDArray[np.float64], every: int, grid: SceneGrid) -> None:
    """Hand every n-th point on from voxel to voxel: two sweeps over the six neighbours.

    Args:
        points_mm: (N, 3) in scene coordinates; those outside the grid are left out.
        every: 1 for all points.
        grid: `nearest` in place; must be -1.

    Source: vector distance transform, Danielsson 1980; not exact, which pairs that only widen the
    basin do not need.
    """
    nearest, origin, voxel = grid.nearest, grid.origin, grid.voxel
    nx, ny, nz = nearest.shape
    distance = np.full((nx, ny, nz), np.inf)
    for i in range(0, points_mm.shape[0], every):
        gx = int(np.floor((points_mm[i, 0] - origin[0]) / voxel + 0.5))
        gy = int(np.floor((points_mm[i, 1] - origin[1]) / voxel + 0.5))
        gz = int(np.floor((points_mm[i, 2] - origin[2]) / voxel + 0.5))
        if min(gx, min(gy, gz)) < 0 or gx >= nx or gy >= ny or gz >= nz:
            continue
        dx = points_mm[i, 0] - origin[0] - gx * voxel
        dy = points_mm[i, 1] - origin[1] - gy * voxel
        dz = points_mm[i, 2] - origin[2] - gz * voxel
        squared = dx * dx + dy * dy + dz * dz
        if squared < distance[gx, gy, gz]:
            distance[gx, gy, gz] = squared
            nearest[gx, gy, gz] = i
    for sweep in range(2):
        step = 1 - 2 * sweep
        for kx in range(nx):
            ix = kx if step == 1 else nx - 1 - kx
            for ky in range(ny):
                iy = ky if step == 1 else ny - 1 - ky
                for kz in range(nz):
                    iz = kz if step == 1 else nz - 1 - kz
                    for axis in range(3):
                        jx = ix - step if axis == 0 else ix
                        jy = iy - step if axis == 1 else iy
                        jz = iz - step if axis == 2 else iz
                        if min(jx, min(jy, jz)) < 0 or jx >= nx or jy >= ny or jz >= nz:
                            continue
                        i = nearest[jx, jy, jz]
                        if i < 0 or i == nearest[ix, iy, iz]:
                            continue
                        dx = points_mm[i, 0] - origin[0] - ix * voxel
                        dy = points_mm[i, 1] - origin[1] - iy * voxel
                        dz = points_mm[i, 2] - origin[2] - iz * voxel
                        squared = dx * dx + dy * dy + dz * dz
                        if squared < distance[ix, iy, iz]:
                            distance[ix, iy, iz] = squared
                            nearest[ix, iy, iz] = i
