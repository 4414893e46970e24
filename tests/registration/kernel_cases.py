"""A small scene, model and pose for the kernels and for their references."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.registration import RegistrationModel, Scene
from navapp.registration.lookup_kernels import ModelArrays, VoxelGrid, find_vertex
from navapp.registration.pairing_kernels import (
    Pairs,
    Pose,
    SceneArrays,
    make_pairs,
    measure_pairs,
)
from tests.reference import bimcc_reference as reference
from tests.registration.shapes import blob

POSE = RigidTransform.from_parts(
    "left_rect", "femur", rotation_from_vector((0.4, -0.9, 0.3)), (10.0, -5.0, 300.0)
)


@dataclass
class Case:
    """Arrays as the kernels read them; `R` and `t` are bone from scene."""

    scene: SceneArrays
    grid: VoxelGrid
    model: ModelArrays
    R: np.ndarray
    t: np.ndarray

    @property
    def pose(self) -> Pose:
        """A copy, for the kernels to move."""
        return Pose(self.R.copy(), self.t.copy())

    @property
    def camera(self) -> np.ndarray:
        return self.R @ self.scene.camera + self.t


@cache
def model_with_a_cut() -> RegistrationModel:
    bone = blob()
    return RegistrationModel(replace(bone, is_removed=bone.mesh.vertices_mm[:, 0] > 24.0))


def make_case(*, has_camera: bool = True, knows_noise: bool = True) -> Case:
    """Points around the whole blob with some 0.8 mm of noise, a little off."""
    rng = np.random.default_rng(11)
    model = model_with_a_cut()
    chosen = rng.choice(len(model.points_mm), 500, replace=False)
    points = POSE.apply(model.points_mm[chosen] + rng.normal(0.0, 0.8, (500, 3)))
    scene = Scene(
        points,
        np.array([20.0, -30.0, 5.0]) if has_camera else None,
        rng.uniform(0.1, 0.6, 500) if knows_noise else None,
        thinned_to=250,
    )
    off = POSE.move((0.5, -0.7, 0.6, 0.02, -0.015, 0.01), POSE.translation_mm)
    R, t = off.inverse_parts()
    return Case(scene.arrays, scene.grid, model.arrays, R, t)


def as_pairs(chosen: np.ndarray, vertex: np.ndarray) -> Pairs:
    pairs = make_pairs(len(chosen))
    pairs.scene[:], pairs.vertex[:] = chosen, vertex
    return pairs


def measured_pairs(case: Case) -> tuple[Pairs, int, reference.Measured, np.ndarray]:
    """Forward pairs measured by the kernel and by the reference, and the vertices."""
    chosen, vertex = reference.pair_forward(case.scene, case.model, case.R, case.t, 1)
    pairs, n = as_pairs(chosen, vertex), len(chosen)
    measure_pairs(case.scene, case.model, case.pose, pairs, n)
    expected = reference.measure_pairs(case.scene, case.model, case.R, case.t, chosen, vertex)
    return pairs, n, expected, vertex


def find_vertices(points_mm: np.ndarray, model: RegistrationModel) -> tuple[np.ndarray, np.ndarray]:
    """Vertex that the kernel finds for each of (N, 3) points in bone coordinates, and how far."""
    arrays = model.arrays
    looked_up = arrays.points, arrays.neighbours, arrays.grid
    index = np.array([find_vertex(*point, *looked_up) for point in points_mm], dtype=np.int32)
    return index, np.linalg.norm(points_mm - arrays.points[index], axis=1)
