"""Compiled correspondences and residuals: forward from scene points, backward from the model's."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.registration.lookup_kernels import ModelArrays, SceneGrid, nearest_vertex

# Beyond so many spacings from its vertex a point is off the model's edge: the vertex's own
# curvature says nothing there.
_CURVATURE_REACH = 2.0


class SceneArrays(NamedTuple):
    """A scene as the kernels read it; lengths in mm, scene coordinates.

    Attributes:
        points: (N, 3).
        sigma_ray: (N,) standard deviation along the ray of sight.
        camera: (3,) where it was seen from.
        has_camera: False: everything may pair, sigma_ray holds in all directions.
    """

    points: NDArray[np.float64]
    sigma_ray: NDArray[np.float64]
    camera: NDArray[np.float64]
    has_camera: bool


class Pairs(NamedTuple):
    """Pairs at a pose, in bone coordinates; only the first n entries hold.

    Attributes:
        scene: (P,) index of the scene point.
        vertex: (P,) index of the model point.
        point: (P, 3) the scene point.
        residual: (P,) its signed distance from the model's surface, mm.
        direction: (P, 3) in which that grows.
        excess: (P,) how far beyond the vertex's own surroundings the point lies, mm.
        variance: (P,) of the residual, mm^2.
        weight: (P,).
    """

    scene: NDArray[np.int32]
    vertex: NDArray[np.int32]
    point: NDArray[np.float64]
    residual: NDArray[np.float64]
    direction: NDArray[np.float64]
    excess: NDArray[np.float64]
    variance: NDArray[np.float64]
    weight: NDArray[np.float64]


def make_pairs(n: int) -> Pairs:
    """Room for n pairs."""
    return Pairs(
        np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32), np.zeros((n, 3)), np.zeros(n),
        np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(n),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def pair_forward(
    scene: SceneArrays,
    model: ModelArrays,
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    camera: NDArray[np.float64],
    every: int,
    pairs: Pairs,
) -> int:
    """Every n-th scene point with its nearest model vertex, where that faces the camera.

    Args:
        scene: what was measured.
        model: prepared bone.
        rotation: (3, 3) bone from scene.
        translation: (3,) of the same, mm.
        camera: (3,) in bone coordinates.
        every: 1 for all points.
        pairs: `scene` and `vertex` written from the beginning.

    Returns:
        How many.
    """
    points, normals, places, can_pair = scene.points, model.normals, model.points, model.can_pair
    has_camera = scene.has_camera
    n = 0
    for i in range(0, points.shape[0], every):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        x = rotation[0, 0] * px + rotation[0, 1] * py + rotation[0, 2] * pz + translation[0]
        y = rotation[1, 0] * px + rotation[1, 1] * py + rotation[1, 2] * pz + translation[1]
        z = rotation[2, 0] * px + rotation[2, 1] * py + rotation[2, 2] * pz + translation[2]
        v = nearest_vertex(x, y, z, places, model.neighbours, model.grid, model.origin, model.voxel)
        if not can_pair[v]:
            continue
        towards = (
            normals[v, 0] * (camera[0] - places[v, 0])
            + normals[v, 1] * (camera[1] - places[v, 1])
            + normals[v, 2] * (camera[2] - places[v, 2])
        )
        if has_camera and towards < 0.0:
            continue
        pairs.scene[n] = i
        pairs.vertex[n] = v
        n += 1
    return n


@njit(cache=True, nogil=True)
def pair_backward(
    scene: SceneArrays,
    grid: SceneGrid,
    model: ModelArrays,
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    camera: NDArray[np.float64],
    every: int,
    radius_mm: float,
    least_cosine: float,
    pairs: Pairs,
    n: int,
) -> int:
    """Every n-th visible model vertex with a nearest scene point within a radius.

    Args:
        scene: what was measured.
        grid: of the scene.
        model: prepared bone.
        rotation: (3, 3) bone from scene.
        translation: (3,) of the same, mm.
        camera: (3,) in bone coordinates.
        every: 1 for all vertices.
        radius_mm: no pair is longer.
        least_cosine: of the angle between normal and line of sight.
        pairs: `scene` and `vertex` written from n on.
        n: so many pairs are there.

    Returns:
        How many there are now.
    """
    points, normals, places, can_pair = scene.points, model.normals, model.points, model.can_pair
    nearest, origin, voxel = grid.nearest, grid.origin, grid.voxel
    nx, ny, nz = nearest.shape
    for v in range(0, places.shape[0], every):
        if not can_pair[v]:
            continue
        if scene.has_camera:
            cx, cy, cz = (
                camera[0] - places[v, 0],
                camera[1] - places[v, 1],
                camera[2] - places[v, 2],
            )
            towards = normals[v, 0] * cx + normals[v, 1] * cy + normals[v, 2] * cz
            if towards < least_cosine * np.sqrt(cx * cx + cy * cy + cz * cz):
                continue
        dx, dy, dz = (
            places[v, 0] - translation[0], places[v, 1] - translation[1],
            places[v, 2] - translation[2],
        )  # fmt: skip
        x = rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
        y = rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
        z = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
        gx = int(np.floor((x - origin[0]) / voxel + 0.5))
        gy = int(np.floor((y - origin[1]) / voxel + 0.5))
        gz = int(np.floor((z - origin[2]) / voxel + 0.5))
        if min(gx, min(gy, gz)) < 0 or gx >= nx or gy >= ny or gz >= nz:
            continue
        i = nearest[gx, gy, gz]
        if i < 0:
            continue
        dx, dy, dz = x - points[i, 0], y - points[i, 1], z - points[i, 2]
        if dx * dx + dy * dy + dz * dz <= radius_mm * radius_mm:
            pairs.scene[n] = i
            pairs.vertex[n] = v
            n += 1
    return n


@njit(cache=True, nogil=True)
def measure_pairs(
    scene: SceneArrays,
    model: ModelArrays,
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    camera: NDArray[np.float64],
    pairs: Pairs,
    first: int,
    n: int,
) -> None:
    """Residual, direction, excess and variance of pairs `first` to `n` at a pose.

    The surface around a vertex v with normal n is taken as f(p) = n.(p - v) + (p - v).B(p - v) / 2:
    a plane would lie off a curved bone by what the vertices are apart.
    """
    points, places, normals, curvature = scene.points, model.points, model.normals, model.curvature
    for k in range(first, n):
        i, v = pairs.scene[k], pairs.vertex[k]
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        x = rotation[0, 0] * px + rotation[0, 1] * py + rotation[0, 2] * pz + translation[0]
        y = rotation[1, 0] * px + rotation[1, 1] * py + rotation[1, 2] * pz + translation[1]
        z = rotation[2, 0] * px + rotation[2, 1] * py + rotation[2, 2] * pz + translation[2]
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


@njit(cache=True, nogil=True)
def count_visible(
    model: ModelArrays, camera: NDArray[np.float64], every: int, least_cosine: float
) -> int:
    """So many vertices face the camera: those that `pair_backward` asks about."""
    normals, places = model.normals, model.points
    n = 0
    for v in range(0, places.shape[0], every):
        cx, cy, cz = camera[0] - places[v, 0], camera[1] - places[v, 1], camera[2] - places[v, 2]
        towards = normals[v, 0] * cx + normals[v, 1] * cy + normals[v, 2] * cz
        is_seen = towards >= least_cosine * np.sqrt(cx * cx + cy * cy + cz * cz)
        n += 1 if is_seen and model.can_pair[v] else 0
    return n
