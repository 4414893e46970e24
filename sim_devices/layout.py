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
# The patella as it lies turned over: its back to the cameras, its upper end up in the picture.
_EVERTED = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]])
_PATELLA_Y_MM, _PATELLA_GAP_MM, _PATELLA_BELOW_MM = -24.0, 3.0, 1.0
_MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
_PLACEMENT_DEG = (6.0, 9.0)
_PLACEMENT_MM = (6.0, 10.0)


def select_side(bone: TriangleMesh, level_mm: float, sign: float) -> TriangleMesh:
    """The faces of a bone on one side of a level of its z."""
    beyond = sign * (bone.vertices_mm[:, 2] - level_mm) > 0.0
    return TriangleMesh(bone.vertices_mm, bone.faces[beyond[bone.faces].all(axis=1)], bone.normals)


def left_from_table(rig: StereoRig, distance_mm: float = WORKING_DISTANCE_MM) -> RigidTransform:
    """The table's frame: halfway between the cameras' axes, at the working distance."""
    left_from_right = rig.right_from_left.inverse()
    half_turn = rotation_from_vector(0.5 * vector_from_rotation(left_from_right.rotation))
    origin = 0.5 * left_from_right.translation_mm + half_turn @ (0.0, 0.0, distance_mm)
    return RigidTransform.from_parts("left", "table", half_turn, origin)


def mirror_pose(pose: RigidTransform) -> RigidTransform:
    """The same pose of the other side of the body."""
    return RigidTransform(pose.target, pose.source, _MIRROR @ pose.matrix @ _MIRROR)


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
    return slide_tibia(femur, tibia, turned, _JOINT_GAP_MM)


def slide_tibia(
    femur: TriangleMesh, tibia: TriangleMesh, femur_from_tibia: RigidTransform, gap_mm: float
) -> RigidTransform:
    """A pose moved along the shin until a gap is left between the bones.

    Args:
        femur: what of it may touch the tibia.
        tibia: likewise.
        femur_from_tibia: the pose.
        gap_mm: smallest distance along the shin.
    """
    rotation = femur_from_tibia.rotation
    found_mm = _gap_mm(femur.transform(femur_from_tibia.inverse().rename("tibia", "femur")), tibia)
    along = rotation @ (0.0, 0.0, found_mm - gap_mm)
    origin = femur_from_tibia.translation_mm + along
    return RigidTransform.from_parts("femur", "tibia", rotation, origin)


def evert_patella(femur: TriangleMesh, patella: TriangleMesh) -> RigidTransform:
    """femur_from_patella of the patella turned over beside the femur, its joint side up.

    Args:
        femur: of a right knee, like the patella.
        patella: likewise.
    """
    table_from_femur = nominal_table_from_femur()
    beside = femur.transform(table_from_femur).vertices_mm
    turned = RigidTransform.from_parts("table", "patella", _EVERTED, np.zeros(3))
    points = turned.apply(patella.vertices_mm)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    level = np.abs(beside[:, 1] - _PATELLA_Y_MM) < 0.5 * np.ptp(points[:, 1])
    lateral = beside[level & (beside[:, 2] < beside[:, 2].min() + 40.0), 0].min()
    place = np.array(
        [
            lateral - _PATELLA_GAP_MM - points[:, 0].max(),
            _PATELLA_Y_MM - centre[1],
            beside[:, 2].min() + _PATELLA_BELOW_MM - points[:, 2].min(),
        ]
    )
    table_from_patella = RigidTransform.from_parts("table", "patella", _EVERTED, place)
    return table_from_femur.inverse() @ table_from_patella


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
