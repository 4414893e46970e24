"""Placement of the simulated knee on the table in front of the cameras."""

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_from_vector, vector_from_rotation
from sim_devices.rigs import WORKING_DISTANCE_MM

# How the knee lies according to the book: the cameras look from the front and below at the
# trochlea and the ends of the condyles, the shin hangs.
_VIEW_TILT_DEG = 30.0
_FLEXION_DEG = 84.0
_FEMUR_ON_TABLE_MM = (0.0, -20.0, 22.0)
_JOINT_GAP_MM = 3.5
_PLACEMENT_DEG = (6.0, 9.0)
_PLACEMENT_MM = (6.0, 10.0)


def select_side(bone: TriangleMesh, level_mm: float, sign: float) -> TriangleMesh:
    """The faces of a bone on one side of a level of its z."""
    beyond = sign * (bone.vertices_mm[:, 2] - level_mm) > 0.0
    return TriangleMesh(bone.vertices_mm, bone.faces[beyond[bone.faces].all(axis=1)], bone.normals)


def left_from_table(rig: StereoRig) -> RigidTransform:
    """The table's frame: halfway between the cameras' axes, at the working distance."""
    left_from_right = rig.right_from_left.inverse()
    half_turn = rotation_from_vector(0.5 * vector_from_rotation(left_from_right.rotation))
    origin = 0.5 * left_from_right.translation_mm + half_turn @ (0.0, 0.0, WORKING_DISTANCE_MM)
    return RigidTransform.from_parts("left", "table", half_turn, origin)


def nominal_table_from_femur() -> RigidTransform:
    """The femur according to the book; knows nothing of how it really lies."""
    tilt = np.radians(_VIEW_TILT_DEG)
    down = np.array([0.0, np.cos(tilt), -np.sin(tilt)])
    away = np.array([0.0, np.sin(tilt), np.cos(tilt)])
    rotation = np.array([[1.0, 0.0, 0.0], down, away])
    return RigidTransform.from_parts("table", "femur", rotation, _FEMUR_ON_TABLE_MM)


def misplace(nominal: RigidTransform, seed: int) -> RigidTransform:
    """The femur as it really lies: 6 to 9 deg and 6 to 10 mm off."""
    rng = np.random.default_rng([seed, 41])
    turn, shift = rng.standard_normal((2, 3))
    turn *= np.radians(rng.uniform(*_PLACEMENT_DEG)) / np.linalg.norm(turn)
    shift *= rng.uniform(*_PLACEMENT_MM) / np.linalg.norm(shift)
    return nominal.move(np.concatenate([shift, turn]), nominal.translation_mm)


def flex_knee(femur: TriangleMesh, tibia: TriangleMesh) -> RigidTransform:
    """femur_from_tibia of the bent knee: turned about the condyles, then set at the joint gap."""
    bottom = femur.vertices_mm[:, 2].min()
    condyles = femur.vertices_mm[femur.vertices_mm[:, 2] < bottom + 40.0]
    centre = np.array([0.0, condyles[:, 1].max() - 21.0, bottom + 22.0])
    rotation = rotation_from_vector((np.radians(_FLEXION_DEG), 0.0, 0.0))
    turned = RigidTransform.from_parts("femur", "tibia", rotation, centre - rotation @ centre)
    gap = _gap_mm(femur.transform(turned.inverse().rename("tibia", "femur")), tibia)
    along = rotation @ (0.0, 0.0, gap - _JOINT_GAP_MM)
    return RigidTransform.from_parts("femur", "tibia", rotation, turned.translation_mm + along)


def _gap_mm(above: TriangleMesh, below: TriangleMesh) -> float:
    """Smallest distance along z between two bodies, on a grid of 2 mm."""
    cells = 100
    low = np.full(cells * cells, np.inf)
    high = np.full(cells * cells, -np.inf)
    for mesh, levels, keep in ((above, low, np.minimum), (below, high, np.maximum)):
        column = np.clip((mesh.vertices_mm[:, :2] / 2.0 + cells / 2).astype(int), 0, cells - 1)
        keep.at(levels, column[:, 0] * cells + column[:, 1], mesh.vertices_mm[:, 2])
    # Only the joint's own side counts: the femur's shaft lies above everything.
    return float(np.min(low - high))
