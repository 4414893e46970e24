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
def voxel_of(
    x: float, y: float, z: float, origin: NDArray[np.float64], voxel: float
) -> tuple[int, int, int]:
    """Voxel whose centre is nearest; it may lie outside the grid."""
    return (
        int(np.floor((x - origin[0]) / voxel + 0.5)),
        int(np.floor((y - origin[1]) / voxel + 0.5)),
        int(np.floor((z - origin[2]) / voxel + 0.5)),
    )


@njit(cache=True, nogil=True)
def is_voxel(gx: int, gy: int, gz: int, grid: NDArray[np.int32]) -> bool:
    """Whether a grid has that voxel."""
    nx, ny, nz = grid.shape
    return bool(0 <= gx < nx and 0 <= gy < ny and 0 <= gz < nz)


@njit(cache=True, nogil=True)
def squared_distance(x: float, y: float, z: float, points: NDArray[np.float64], i: int) -> float:
    """Of a place from point i."""
    dx, dy, dz = x - points[i, 0], y - points[i, 1], z - points[i, 2]
    squared: float = dx * dx + dy * dy + dz * dz
    return squared


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
    gx, gy, gz = voxel_of(x, y, z, origin, voxel)
    best: int = grid[min(max(gx, 0), nx - 1), min(max(gy, 0), ny - 1), min(max(gz, 0), nz - 1)]
    least = squared_distance(x, y, z, points, best)
    start = -1
    while start != best:
        start = best
        for k in range(neighbours.shape[1]):
            other = neighbours[start, k]
            if other < 0:
                break
            squared = squared_distance(x, y, z, points, other)
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
        index[i] = best
        distance_mm[i] = np.sqrt(squared_distance(x, y, z, model.points, best))


@njit(cache=True, nogil=True)
def scene_point_near(
    x: float, y: float, z: float, points: NDArray[np.float64], grid: SceneGrid, radius_mm: float
) -> int:
    """A scene point near a place, the nearest or almost; -1 beyond the radius or the grid."""
    gx, gy, gz = voxel_of(x, y, z, grid.origin, grid.voxel)
    if not is_voxel(gx, gy, gz, grid.nearest):
        return -1
    i: int = grid.nearest[gx, gy, gz]
    if i < 0 or squared_distance(x, y, z, points, i) > radius_mm * radius_mm:
        return -1
    return i


@njit(cache=True, nogil=True)
def squared_from_centre(
    points_mm: NDArray[np.float64], i: int, gx: int, gy: int, gz: int, grid: SceneGrid
) -> float:
    """Of point i from the centre of a voxel."""
    origin, voxel = grid.origin, grid.voxel
    squared: float = squared_distance(
        origin[0] + gx * voxel, origin[1] + gy * voxel, origin[2] + gz * voxel, points_mm, i
    )
    return squared


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
        x, y, z = points_mm[i, 0], points_mm[i, 1], points_mm[i, 2]
        gx, gy, gz = voxel_of(x, y, z, origin, voxel)
        if not is_voxel(gx, gy, gz, nearest):
            continue
        squared = squared_from_centre(points_mm, i, gx, gy, gz, grid)
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
                        if not is_voxel(jx, jy, jz, nearest):
                            continue
                        i = nearest[jx, jy, jz]
                        if i < 0 or i == nearest[ix, iy, iz]:
                            continue
                        squared = squared_from_centre(points_mm, i, ix, iy, iz, grid)
                        if squared < distance[ix, iy, iz]:
                            distance[ix, iy, iz] = squared
                            nearest[ix, iy, iz] = i
