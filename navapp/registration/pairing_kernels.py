"""Compiled correspondences and residuals: forward from scene points, backward from the model's."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.facing_kernels import faces
from navapp.geometry.motion_kernels import move_point
from navapp.geometry.transform import FloatArray
from navapp.registration.lookup_kernels import (
    ModelArrays,
    VoxelGrid,
    find_vertex,
    find_voxel,
    has_voxel,
    squared_distance,
)

# Chosen: beyond so many spacings from its vertex a point is off the model's edge, where the
# vertex's own curvature says nothing.
_CURVATURE_REACH = 2.0


class Pose(NamedTuple):
    """(3, 3) and (3,) of p -> rotation @ p + translation, mm: bone from scene, moved in place."""

    rotation: FloatArray
    translation: FloatArray


class SceneArrays(NamedTuple):
    """A scene as the kernels read it; lengths in mm, scene coordinates."""

    points: FloatArray  # (N, 3)
    sigma_ray: FloatArray  # (N,) standard deviation along the ray of sight
    camera: FloatArray  # (3,) where it was seen from
    has_camera: bool  # False: everything may pair, sigma_ray holds in all directions
    knows_noise: bool  # False: sigma_ray is 0, the noise shows in the residuals
    every: int  # the coarse loop uses every n-th point


class Pairs(NamedTuple):
    """Pairs at a pose, in bone coordinates; only the first n entries hold."""

    scene: NDArray[np.int32]  # (P,) index of the scene point
    vertex: NDArray[np.int32]  # (P,) index of the model point
    point: FloatArray  # (P, 3) the scene point
    residual: FloatArray  # (P,) its signed distance from the model's surface, mm
    direction: FloatArray  # (P, 3) in which that grows
    excess: FloatArray  # (P,) how far beyond the vertex's own surroundings the point lies, mm
    variance: FloatArray  # (P,) of the residual, mm^2
    weight: FloatArray  # (P,)


def make_pairs(n: int) -> Pairs:
    """Room for n pairs."""
    return Pairs(
        np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32), np.zeros((n, 3)), np.zeros(n),
        np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(n),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def pair_forward(
    scene: SceneArrays, model: ModelArrays, pose: Pose, every: int, pairs: Pairs
) -> int:
    """Every n-th scene point with its nearest model vertex, where that faces the camera.

    Writes `scene` and `vertex` of the pairs; returns how many there are.
    """
    points, normals, places, can_pair = scene.points, model.normals, model.points, model.can_pair
    camera = pose.rotation @ scene.camera + pose.translation
    n = 0
    for i in range(0, points.shape[0], every):
        x, y, z = move_point(pose.rotation, pose.translation, points, i)
        v = find_vertex(x, y, z, places, model.neighbours, model.grid)
        if not can_pair[v]:
            continue
        if scene.has_camera and not faces(camera, places, normals, v, 0.0):
            continue
        pairs.scene[n] = i
        pairs.vertex[n] = v
        n += 1
    return n


@njit(cache=True, nogil=True)
def pair_backward(
    scene: SceneArrays, grid: VoxelGrid, model: ModelArrays, pose: Pose, every: int,
    radius_mm: float, least_cosine: float, pairs: Pairs, n: int,
) -> tuple[int, int]:  # fmt: skip
    """Every n-th visible model vertex with a nearest scene point within a radius.

    A vertex is visible when the cosine between its normal and its line of sight is large enough.
    Writes `scene` and `vertex` of the pairs from n on; returns how many pairs there are now, and
    how many vertices are visible.
    """
    points, normals, places, can_pair = scene.points, model.normals, model.points, model.can_pair
    camera = pose.rotation @ scene.camera + pose.translation
    rotation = pose.rotation.T.copy()
    translation = -(rotation @ pose.translation)
    n_visible = 0
    for v in range(0, places.shape[0], every):
        if not can_pair[v]:
            continue
        if scene.has_camera and not faces(camera, places, normals, v, least_cosine):
            continue
        n_visible += 1
        x, y, z = move_point(rotation, translation, places, v)
        ix, iy, iz = find_voxel(x, y, z, grid)
        if not has_voxel(grid, ix, iy, iz):
            continue
        i = grid.nearest[ix, iy, iz]
        if i >= 0 and squared_distance(x, y, z, points, i) <= radius_mm * radius_mm:
            pairs.scene[n] = i
            pairs.vertex[n] = v
            n += 1
    return n, n_visible


@njit(cache=True, nogil=True)
def measure_pairs(scene: SceneArrays, model: ModelArrays, pose: Pose, pairs: Pairs, n: int) -> None:
    """Point, residual, direction, excess and variance of the first n pairs at a pose.

    Around a vertex v with normal n the surface is f(p) = n.(p - v) + (p - v).B(p - v) / 2 = 0: a
    plane would lie off a curved bone between the vertices.
    """
    points, places, normals, curvature = scene.points, model.points, model.normals, model.curvature
    camera = pose.rotation @ scene.camera + pose.translation
    for k in range(n):
        i, v = pairs.scene[k], pairs.vertex[k]
        x, y, z = move_point(pose.rotation, pose.translation, points, i)
        pairs.point[k, 0], pairs.point[k, 1], pairs.point[k, 2] = x, y, z
        dx, dy, dz = x - places[v, 0], y - places[v, 1], z - places[v, 2]
        gx, gy, gz = normals[v, 0], normals[v, 1], normals[v, 2]
        out = gx * dx + gy * dy + gz * dz
        along = np.sqrt(max(dx * dx + dy * dy + dz * dz - out * out, 0.0))
        spacing = model.spacing[v]
        if along < _CURVATURE_REACH * spacing:
            bx = curvature[v, 0] * dx + curvature[v, 3] * dy + curvature[v, 4] * dz
            by = curvature[v, 3] * dx + curvature[v, 1] * dy + curvature[v, 5] * dz
            bz = curvature[v, 4] * dx + curvature[v, 5] * dy + curvature[v, 2] * dz
            gx, gy, gz = gx + bx, gy + by, gz + bz
            length = np.sqrt(gx * gx + gy * gy + gz * gz)
            out = (out + 0.5 * (bx * dx + by * dy + bz * dz)) / length
            gx, gy, gz = gx / length, gy / length, gz / length
        pairs.residual[k] = out
        pairs.direction[k, 0], pairs.direction[k, 1], pairs.direction[k, 2] = gx, gy, gz
        pairs.excess[k] = max(along - spacing, 0.0)
        seen2 = scene.sigma_ray[i] ** 2
        if scene.has_camera:
            rx, ry, rz = x - camera[0], y - camera[1], z - camera[2]
            cosine = gx * rx + gy * ry + gz * rz
            seen2 *= cosine * cosine / max(rx * rx + ry * ry + rz * rz, 1e-12)
        pairs.variance[k] = seen2 + model.sigma[v] ** 2
