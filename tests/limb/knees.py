"""A knee whose bones and axes are simple, and poses of it."""

import numpy as np

from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.values import ANKLE_CENTRE, HIP_CENTRE, Landmark, PoseEstimate, Side

FEMUR_POINTS_MM = {
    HIP_CENTRE: (0.0, 0.0, 400.0),
    "femur/knee_centre": (0.0, 0.0, 0.0),
}
TIBIA_POINTS_MM = {ANKLE_CENTRE: (0.0, 0.0, -380.0)}


def landmarks(side: Side = "right") -> dict[str, Landmark]:
    """Axes along the plan's own: x to the patient's left, y to the back, z upwards."""
    medial = 1.0 if side == "right" else -1.0
    points_mm = {
        **FEMUR_POINTS_MM,
        **TIBIA_POINTS_MM,
        "femur/medial_epicondyle": (medial * 40.0, 0.0, 20.0),
        "femur/lateral_epicondyle": (-medial * 40.0, 0.0, 20.0),
        "tibia/medial_plateau": (medial * 20.0, 0.0, -5.0),
        "tibia/lateral_plateau": (-medial * 20.0, 0.0, -5.0),
    }
    return {name: Landmark(np.array(one), None, "contents") for name, one in points_mm.items()}


def estimate(pose: RigidTransform, covariance: np.ndarray | None = None) -> PoseEstimate:
    """Of a pose, exact without a covariance."""
    known = np.zeros((6, 6)) if covariance is None else covariance
    return PoseEstimate(pose, known, 100, 1.0, 0.1, 0.1, 3, True)


def camera_from_femur() -> RigidTransform:
    """Somewhere before the cameras."""
    turn = rotation_from_vector((0.4, -0.7, 0.2))
    return RigidTransform.from_parts("left", "femur", turn, (10.0, -20.0, 450.0))


def femur_from_tibia(
    flexion_deg: float = 0.0, lean_deg: float = 0.0, twist_deg: float = 0.0
) -> RigidTransform:
    """Turned about the femur's x, then a floating y, then the tibia's z."""
    turns = [
        rotation_from_vector(np.radians(angle) * np.eye(3)[axis])
        for axis, angle in enumerate((flexion_deg, lean_deg, twist_deg))
    ]
    return RigidTransform.from_parts("femur", "tibia", turns[0] @ turns[1] @ turns[2], (0, 0, -3.0))
