"""Compiled look-ups: the nearest vertex of a model, the nearest point of a scene."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray

# Chosen: with one round, places far from a bone may name a vertex that lies millimetres further
# than the nearest (tests/registration/test_lookup_kernels.py: less than 0.3 mm with two).
_ROUNDS = 2


class VoxelGrid(NamedTuple):
    """Which point is near each place; lengths in mm, in the frame of the points."""

    # (nx, ny, nz) index of the point nearest to each voxel's centre, or of one that is hardly
    # further; -1 for none.
    nearest: NDArray[np.int32]
    origin: FloatArray  # (3,) centre of voxel (0, 0, 0)
    voxel: float  # edge of the voxels


class ModelArrays(NamedTuple):
    """A model as the kernels read it; lengths in mm, bone coordinates."""

    points: FloatArray  # (V, 3) of the surface
    normals: FloatArray  # (V, 3) unit, outward
    # (V, 6) how the normal turns along the surface: xx, yy, zz, xy, xz, yz of a symmetric matrix,
    # 1/mm.
    curvature: FloatArray
    spacing: FloatArray  # (V,) mean distance to the neighbours
    sigma: FloatArray  # (V,) of the surface along the normal
    can_pair: NDArray[np.bool_]  # (V,) False at open borders and where a stage has cut
    neighbours: NDArray[np.int32]  # (V, K) vertices beside each vertex, -1 padded
    grid: VoxelGrid  # of nearest vertices; no voxel is without one


@njit(cache=True, nogil=True)
def find_voxel(x: float, y: float, z: float, grid: VoxelGrid) -> tuple[int, int, int]:
    """Voxel whose centre is nearest; it may lie outside the grid."""
    return (
        int(np.floor((x - grid.origin[0]) / grid.voxel + 0.5)),
        int(np.floor((y - grid.origin[1]) / grid.voxel + 0.5)),
        int(np.floor((z - grid.origin[2]) / grid.voxel + 0.5)),
    )


@njit(cache=True, nogil=True)
def _centre_mm(ix: int, iy: int, iz: int, grid: VoxelGrid) -> tuple[float, float, float]:
    """Centre of a voxel."""
    return (
        grid.origin[0] + ix * grid.voxel,
        grid.origin[1] + iy * grid.voxel,
        grid.origin[2] + iz * grid.voxel,
    )


@njit(cache=True, nogil=True)
def has_voxel(grid: VoxelGrid, ix: int, iy: int, iz: int) -> bool:
    """Whether the voxel lies inside the grid."""
    nx, ny, nz = grid.nearest.shape
    return bool(0 <= ix < nx and 0 <= iy < ny and 0 <= iz < nz)


@njit(cache=True, nogil=True)
def squared_distance(x: float, y: float, z: float, points: FloatArray, i: int) -> float:
    """Of a place from point i."""
    dx, dy, dz = x - points[i, 0], y - points[i, 1], z - points[i, 2]
    squared: float = dx * dx + dy * dy + dz * dz
    return squared


@njit(cache=True, nogil=True)
def find_vertex(
    x: float, y: float, z: float, points: FloatArray, neighbours: NDArray[np.int32], grid: VoxelGrid
) -> int:
    """Nearest vertex of a place: the answer of the grid's nearest voxel, then descent.

    To hand over all of `ModelArrays` at every point would cost as much as the look-up.
    """
    nx, ny, nz = grid.nearest.shape
    ix, iy, iz = find_voxel(x, y, z, grid)
    ix, iy, iz = min(max(ix, 0), nx - 1), min(max(iy, 0), ny - 1), min(max(iz, 0), nz - 1)
    first: int = grid.nearest[ix, iy, iz]
    least = squared_distance(x, y, z, points, first)
    best: int = _descend(x, y, z, points, neighbours, first, least)[0]
    return best


@njit(cache=True, nogil=True)
def _descend(
    x: float, y: float, z: float, points: FloatArray, neighbours: NDArray[np.int32],
    first: int, least: float,
) -> tuple[int, float]:  # fmt: skip
    """Step from vertex `first` to the neighbour nearest to a place (x, y, z), while one is nearer.

    `least` is the squared distance of `first`; the answer is a vertex and its squared distance.
    """
    best, start = first, -1
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
    return best, least


@njit(cache=True, nogil=True)
def offer_point(
    points_mm: FloatArray, i: int, ix: int, iy: int, iz: int, grid: VoxelGrid, squared: FloatArray
) -> None:
    """Point i becomes a voxel's nearest if it is; `squared` holds the distances of the nearest."""
    x, y, z = _centre_mm(ix, iy, iz, grid)
    offered = squared_distance(x, y, z, points_mm, i)
    if offered < squared[ix, iy, iz]:
        squared[ix, iy, iz] = offered
        grid.nearest[ix, iy, iz] = i


@njit(cache=True, nogil=True)
def fill_scene_grid(points_mm: FloatArray, every: int, grid: VoxelGrid) -> None:
    """Hand every n-th point on from voxel to voxel: two sweeps over the six neighbours.

    Points are (N, 3) in scene coordinates; those outside the grid are left out. `grid.nearest` is
    written in place and must be -1. Cheaper than a tree, which every frame would need anew.

    Source: vector distance transform, Danielsson 1980; not exact, which pairs that only widen the
    basin do not need.
    """
    squared = np.full(grid.nearest.shape, np.inf)
    _seed(points_mm, every, grid, squared)
    _sweep(points_mm, grid, squared)


@njit(cache=True, nogil=True)
def fill_model_grid(points_mm: FloatArray, neighbours: NDArray[np.int32], grid: VoxelGrid) -> None:
    """The vertex (V, 3) nearest to each voxel's centre, or one that is hardly further.

    Handed on as in `fill_scene_grid`; each voxel then looks among the neighbours (V, K, -1 padded)
    of what it was given for a nearer one, and hands that on. `grid.nearest` is written in place and
    must be -1.
    """
    squared = np.full(grid.nearest.shape, np.inf)
    _seed(points_mm, 1, grid, squared)
    nx, ny, nz = grid.nearest.shape
    for _ in range(_ROUNDS):
        _sweep(points_mm, grid, squared)
        for ix in range(nx):
            for iy in range(ny):
                for iz in range(nz):
                    x, y, z = _centre_mm(ix, iy, iz, grid)
                    first, least = grid.nearest[ix, iy, iz], squared[ix, iy, iz]
                    best, least = _descend(x, y, z, points_mm, neighbours, first, least)
                    grid.nearest[ix, iy, iz], squared[ix, iy, iz] = best, least


@njit(cache=True, nogil=True)
def _seed(points_mm: FloatArray, every: int, grid: VoxelGrid, squared: FloatArray) -> None:
    """Offer every n-th point to the voxel that it lies in, if there is one."""
    for i in range(0, points_mm.shape[0], every):
        ix, iy, iz = find_voxel(points_mm[i, 0], points_mm[i, 1], points_mm[i, 2], grid)
        if has_voxel(grid, ix, iy, iz):
            offer_point(points_mm, i, ix, iy, iz, grid, squared)


@njit(cache=True, nogil=True)
def _sweep(points_mm: FloatArray, grid: VoxelGrid, squared: FloatArray) -> None:
    """Hand points on from voxel to voxel, forth and back."""
    nx, ny, nz = grid.nearest.shape
    xs, ys, zs = np.arange(nx), np.arange(ny), np.arange(nz)
    for step in (1, -1):
        for ix in xs[::step]:
            for iy in ys[::step]:
                for iz in zs[::step]:
                    for dx, dy, dz in ((step, 0, 0), (0, step, 0), (0, 0, step)):
                        jx, jy, jz = ix - dx, iy - dy, iz - dz
                        if not has_voxel(grid, jx, jy, jz):
                            continue
                        i = grid.nearest[jx, jy, jz]
                        if i >= 0 and i != grid.nearest[ix, iy, iz]:
                            offer_point(points_mm, i, ix, iy, iz, grid, squared)
