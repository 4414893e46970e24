"""Compiled correspondences and residuals: forward from scene points, backward from the model's."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.facing_kernels import faces
from navapp.registration.lookup_kernels import (
    ModelArrays,
    SceneGrid,
    nearest_vertex,
    scene_point_near,
)

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
def moved(
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    points: NDArray[np.float64],
    i: int,
) -> tuple[float, float, float]:
    """Point i after a rotation and a translation."""
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    return (
        rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z + translation[0],
        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z + translation[1],
        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z + translation[2],
    )


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
        x, y, z = moved(rotation, translation, points, i)
        v = nearest_vertex(x, y, z, places, model.neighbours, model.grid, model.origin, model.voxel)
        if not can_pair[v]:
            continue
        if has_camera and not faces(camera, places, normals, v, 0.0):
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
    inverse = rotation.T.copy()
    shift = -(inverse @ translation)
    for v in range(0, places.shape[0], every):
        if not can_pair[v]:
            continue
        if scene.has_camera and not faces(camera, places, normals, v, least_cosine):
            continue
        x, y, z = moved(inverse, shift, places, v)
        i = scene_point_near(x, y, z, points, grid, radius_mm)
        if i >= 0:
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
        x, y, z = moved(rotation, translation, points, i)
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
        is_seen = faces(camera, places, normals, v, least_cosine)
        n += 1 if is_seen and model.can_pair[v] else 0
    return n
