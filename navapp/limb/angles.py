"""Flexion, varus and internal rotation of a knee, with bounds.

The joint coordinate system of Grood and Suntay (1983): flexion is about the femur's axis to the
left, rotation about the tibia's mechanical axis, varus about the floating axis across both.
"""

import math
from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.limb.axes import LimbAxes
from navapp.values import PoseEstimate, Side
from navapp.values.faces import SIZE_95


@dataclass(frozen=True, slots=True)
class LimbAngles:
    """Degrees, and their 95 % bounds by the two poses; negative varus is valgus, and so on."""

    flexion_deg: float
    varus_deg: float
    internal_rotation_deg: float
    flexion_bound_deg: float
    varus_bound_deg: float
    internal_rotation_bound_deg: float


def measure_angles(
    axes: LimbAxes, femur: PoseEstimate, tibia: PoseEstimate, side: Side
) -> LimbAngles:
    """The angles of two poses of one pair of pictures.

    What their errors have in common is not known; they count as independent.
    """
    seen_femur = femur.camera_from_bone.rotation @ axes.femur
    seen_tibia = tibia.camera_from_bone.rotation @ axes.tibia
    turn = seen_femur.T @ seen_tibia
    flexion_rad = math.atan2(-turn[1, 2], turn[2, 2])
    lean_rad = math.asin(max(-1.0, min(1.0, turn[0, 2])))
    twist_rad = math.atan2(-turn[0, 1], turn[0, 0])
    deviations = _deviations(seen_femur[:, 0], seen_tibia[:, 2], femur, tibia)
    bounds = np.degrees(SIZE_95 * deviations)
    # The tibia leans to the right and turns to the left with positive angles.
    to_medial = 1.0 if side == "right" else -1.0
    return LimbAngles(
        math.degrees(flexion_rad),
        -to_medial * math.degrees(lean_rad),
        to_medial * math.degrees(twist_rad),
        float(bounds[0]),
        float(bounds[1]),
        float(bounds[2]),
    )


def _deviations(
    left: FloatArray, up: FloatArray, femur: PoseEstimate, tibia: PoseEstimate
) -> FloatArray:
    """(3,) rad: standard deviations of flexion, lean and twist.

    A small turn w of the tibia against the femur is w = a e1 + b e2 + c e3 with the changes a, b, c
    of the angles: e1 the femur's axis, e3 the tibia's, e2 across both. J is the inverse.

    Args:
        left: (3,) e1, in the camera.
        up: (3,) e3, in the camera.
        femur: its pose.
        tibia: its pose.
    """
    across = np.cross(up, left)
    jacobian = np.linalg.inv(np.column_stack([left, across / np.linalg.norm(across), up]))
    covariance = femur.rotation_covariance + tibia.rotation_covariance
    return np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))
