"""A tip at rest, or a pick in the picture, as a touch of the check on the patient."""

from collections import deque

import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tools.patient_check import Touched
from navapp.tools.surface_distance import SurfaceDistance
from navapp.tools.tool_on_bone import ToolOnBone
from navapp.values import Pick, Plan

# A tip rests when so many readings of consecutive frames lie within so much of each other.
_N_RESTING, _REST_MM = 5, 0.3
# What pressing on tissue, and a model's own error, add to a touch.
_TOUCH_SIGMA_MM = 0.15
# Of a pick in the picture, with the magnifier.
_PICK_SIGMA_PX = 2.0
# Of a landmark of which the plan does not say how well it is known.
_LANDMARK_SIGMA_MM = 0.5


class RestingTip:
    """Waits until a tip rests, frame by frame."""

    def __init__(self) -> None:
        self._tips: deque[FloatArray] = deque(maxlen=_N_RESTING)

    @property
    def is_seen(self) -> bool:
        """In the newest frame."""
        return len(self._tips) > 0

    def add(self, tip_mm: FloatArray | None) -> FloatArray | None:
        """The tip (3,) in one more frame, None where it is not seen; its mean once it rests."""
        if tip_mm is None:
            self._tips.clear()
            return None
        self._tips.append(tip_mm)
        tips = np.array(self._tips)
        if len(tips) < _N_RESTING or float(np.ptp(tips, axis=0).max()) > _REST_MM:
            return None
        return np.asarray(tips.mean(axis=0))


def touch_surface(placed: ToolOnBone, tip_mm: FloatArray, surface: SurfaceDistance) -> Touched:
    """A tip (3,) on the bone's surface, bone coordinates: it tells how far that is off."""
    distance_mm, foot_mm, normal = surface.find(tip_mm)
    sigma_mm = float(np.sqrt(normal @ placed.covariance_mm2 @ normal))
    return Touched(foot_mm, normal[None], np.array([distance_mm]), add_touch_sigma(sigma_mm))


def touch_landmark(placed: ToolOnBone, tip_mm: FloatArray, landmark: str, plan: Plan) -> Touched:
    """A tip (3,) on a landmark of the plan, bone coordinates."""
    point_mm = plan.landmarks_of(placed.bone)[landmark]
    sigma_mm = float(np.sqrt(np.trace(placed.covariance_mm2) / 3.0))
    sigma_mm = add_touch_sigma(float(np.hypot(sigma_mm, _landmark_sigma_mm(landmark, plan))))
    return Touched(point_mm, np.eye(3), tip_mm - point_mm, sigma_mm, landmark)


def see_pick(pick: Pick, left_from_bone: RigidTransform, left: Camera, plan: Plan) -> Touched:
    """A landmark picked in the left picture.

    It says where the landmark is across the line of sight, and nothing along it.
    """
    ray = left.rays(np.array([pick.left_px]))[0]
    sight = ray / np.linalg.norm(ray)
    place = left_from_bone.apply(pick.model_mm)
    across = np.linalg.svd(sight[None])[2][1:]
    depth_mm = float(place @ sight)
    sigma_mm = _PICK_SIGMA_PX * depth_mm / left.focal_px
    return Touched(
        pick.model_mm,
        across @ left_from_bone.rotation,
        across @ (depth_mm * sight - place),
        float(np.hypot(sigma_mm, _landmark_sigma_mm(pick.name, plan))),
        pick.name,
    )


def add_touch_sigma(sigma_mm: float) -> float:
    """Of a touch by a tip that is known so well."""
    return float(np.hypot(sigma_mm, _TOUCH_SIGMA_MM))


def _landmark_sigma_mm(landmark: str, plan: Plan) -> float:
    planned = plan.content.landmarks.get(landmark)
    known_mm = None if planned is None else planned.sd_mm
    return _LANDMARK_SIGMA_MM if known_mm is None else known_mm
