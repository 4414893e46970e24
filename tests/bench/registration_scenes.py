"""Scenes for the registration benchmark: one side of a bone, noise, clutter, a disturbed start.

The protocol: a camera 450 mm away within 60 deg of the joint's axis; 1,800 points of the bone where
the normal leans towards it, with 0.5 mm noise; 600 points all over, 600 on a sheet beside the bone.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from navapp.registration import RegistrationModel
from navapp.values import BoneModel

BONES = ("femur_1", "femur_2", "femur_3", "tibia_1", "tibia_2")
N_ON_BONE, N_CLUTTER, NOISE_MM = 1800, 600, 0.5
_CAMERA_MM = 450.0
_LEAST_FACING = 0.35
_CAP_COSINE = -np.cos(np.radians(30.0))
_CAP_MM = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Bone:
    """A bone end without the flat cap of its shaft, whole and as a model of fewer vertices."""

    name: str
    mesh: TriangleMesh
    joint_axis: FloatArray
    dense: RegistrationModel
    model: RegistrationModel


@dataclass(frozen=True, slots=True, eq=False)
class Clouded:
    """A scene, seen from `camera_mm`; its first `N_ON_BONE` points are bone."""

    points_mm: FloatArray
    camera_mm: FloatArray
    true: RigidTransform
    start: RigidTransform


def load_bone(folder: Path, name: str, n_vertices: int) -> Bone:
    """A bone of `bones/pymskt` and a decimated model of about so many vertices."""
    mesh = read_ply(folder / f"{name}.ply")[0].largest_component()
    mesh = mesh.flip() if mesh.volume_mm3() < 0.0 else mesh
    axis = np.array([0.0, 0.0, -1.0 if name.startswith("femur") else 1.0])
    normals, _ = _faces_of(mesh)
    height = mesh.vertices_mm @ axis
    is_cap = (normals @ axis < _CAP_COSINE) & (
        height[mesh.faces].mean(axis=1) < height.min() + _CAP_MM
    )
    open_mesh = TriangleMesh(mesh.vertices_mm, mesh.faces[~is_cap])
    dense = RegistrationModel(BoneModel(name, open_mesh))
    model = RegistrationModel(BoneModel(name, _decimated(open_mesh, n_vertices)))
    _ = dense.arrays, model.arrays
    return Bone(name, open_mesh, axis, dense, model)


def clouded(bone: Bone, turn_deg: float, shift_mm: float, seed: int) -> Clouded:
    """One scene and a start that is off by exactly so much about the scene's centroid."""
    rng = np.random.default_rng(seed)
    direction = _direction(rng, bone.joint_axis)
    camera = bone.mesh.centroid_mm + _CAMERA_MM * direction
    points = _seen_points(bone.mesh, direction, rng)
    points = points + NOISE_MM * rng.standard_normal(points.shape)
    points = np.concatenate([points, *_clutter(points, direction, rng)])
    rotation = rotation_from_vector(rng.uniform(0.0, np.pi) * _unit(rng))
    true = RigidTransform.from_parts("scene", bone.name, rotation, rng.uniform(-200.0, 200.0, 3))
    points = true.apply(points)
    twist = np.concatenate([shift_mm * _unit(rng), np.radians(turn_deg) * _unit(rng)])
    start = true.move(twist, points[:N_ON_BONE].mean(axis=0))
    return Clouded(points, true.apply(camera), true, start)


def error_mm(bone: Bone, found: RigidTransform, scene: Clouded) -> float:
    """TRE over the model's vertices."""
    vertices = bone.mesh.vertices_mm
    return float(np.linalg.norm(found.apply(vertices) - scene.true.apply(vertices), axis=1).mean())


def scenes(
    bone: Bone, turn_deg: float, shift_mm: float, n_seeds: int, first_seed: int = 0
) -> Iterator[Clouded]:
    """Scenes of consecutive seeds."""
    for seed in range(first_seed, first_seed + n_seeds):
        yield clouded(bone, turn_deg, shift_mm, seed)


def information_limit_mm(bone: Bone, scene: Clouded) -> float:
    """TRE of least squares on the true bone points and the dense surface, from the truth."""
    dense, pose = bone.dense, scene.true
    tree = cKDTree(dense.points_mm)
    points = scene.points_mm[:N_ON_BONE]
    for _ in range(10):
        moved = pose.inverse().apply(points)
        _, index = tree.query(moved)
        normals, offset = dense.normals[index], moved - dense.points_mm[index]
        curvature = dense.arrays.curvature[index]
        curved = np.stack(
            [
                (curvature[:, [0, 3, 4]] * offset).sum(axis=1),
                (curvature[:, [3, 1, 5]] * offset).sum(axis=1),
                (curvature[:, [4, 5, 2]] * offset).sum(axis=1),
            ],
            axis=1,
        )
        residual = (normals * offset).sum(axis=1) + 0.5 * (curved * offset).sum(axis=1)
        jacobian = np.hstack([normals, np.cross(moved, normals)])
        step = np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        pose = pose.inverse().move(-step, np.zeros(3)).inverse()
    return error_mm(bone, pose, scene)


def least_share(bone: Bone, scene: Clouded) -> float:
    """Least over largest eigenvalue of what the true bone points fix at the true pose.

    Lengths are in units of the seen surface's radius.
    """
    points = scene.true.inverse().apply(scene.points_mm[:N_ON_BONE])
    _, index = cKDTree(bone.dense.points_mm).query(points)
    normals = bone.dense.normals[index]
    offset = points - points.mean(axis=0)
    radius = np.sqrt((offset**2).sum(axis=1).mean())
    rows = np.hstack([normals, np.cross(offset, normals) / radius])
    eigenvalues = np.linalg.eigvalsh(rows.T @ rows)
    return float(eigenvalues[0] / eigenvalues[-1])


def _direction(rng: np.random.Generator, axis: FloatArray) -> FloatArray:
    """Unit vector within 60 deg of an axis."""
    while True:
        direction = _unit(rng)
        if direction @ axis > 0.5:
            return direction


def _seen_points(mesh: TriangleMesh, direction: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Points spread evenly over the triangles that lean towards a direction."""
    normals, areas = _faces_of(mesh)
    seen = np.flatnonzero(normals @ direction > _LEAST_FACING)
    chosen = rng.choice(seen, N_ON_BONE, p=areas[seen] / areas[seen].sum())
    u, v = rng.random((2, N_ON_BONE, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = (mesh.vertices_mm[mesh.faces[chosen, k]] for k in range(3))
    points: FloatArray = a + u * (b - a) + v * (c - a)
    return points


def _clutter(
    points: FloatArray, direction: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Points in a box of 1.2 times the bone's, and a noisy sheet of 80 x 24 mm beside it."""
    low, high = points.min(axis=0), points.max(axis=0)
    extent = 0.6 * (high - low)
    box = 0.5 * (low + high) + rng.uniform(-1.0, 1.0, (N_CLUTTER, 3)) * extent
    aside = np.cross(direction, _unit(rng))
    aside /= np.linalg.norm(aside)
    along = np.cross(direction, aside)
    place = rng.uniform(-40.0, 40.0, (N_CLUTTER, 2))
    sheet = points.mean(axis=0) + (extent.max() + 5.0) * aside - 5.0 * direction
    sheet = sheet + place[:, :1] * along + 0.3 * place[:, 1:] * aside
    return box, sheet + 0.3 * rng.standard_normal((N_CLUTTER, 3))


def _faces_of(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """(F, 3) unit normals and (F,) areas of the triangles."""
    a, b, c = (mesh.vertices_mm[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    return normals / np.maximum(length, 1e-12)[:, None], 0.5 * length


def _decimated(mesh: TriangleMesh, n_vertices: int) -> TriangleMesh:
    """A mesh of about so many vertices, by quadric decimation (Open3D)."""
    import open3d

    dense = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(np.array(mesh.vertices_mm)),
        open3d.utility.Vector3iVector(np.array(mesh.faces)),
    )
    coarse = dense.simplify_quadric_decimation(2 * n_vertices).remove_unreferenced_vertices()
    return TriangleMesh(np.asarray(coarse.vertices), np.asarray(coarse.triangles, dtype=np.int32))


def _unit(rng: np.random.Generator) -> FloatArray:
    vector: FloatArray = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)
