"""First registration: many starts around a rough pose, ranked by how they fit."""

from collections.abc import Callable, Sequence

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.model import RegistrationModel
from navapp.registration.point_to_plane import PointToPlaneSettings, fit_point_to_plane
from navapp.values import PoseEstimate, SurfaceCloud

# Poses nearer than this are the same answer.
_SAME_MM = 2.0
_SAME_RAD = 0.035

_COARSE = PointToPlaneSettings(radii_mm=(12.0, 6.0), max_iterations=12)
_COARSE_POINTS = 700


def tilted_starts(
    pose: RigidTransform, centre_mm: FloatArray, tilt_deg: float = 15.0, n_tilts: int = 12
) -> list[RigidTransform]:
    """The pose and tilts of it about the bone's centre, axes spread over the sphere.

    Args:
        pose: `camera_from_bone`.
        centre_mm: (3,) in bone coordinates.
        tilt_deg: angle of each tilt.
        n_tilts: how many.
    """
    centre = pose.apply(centre_mm)
    starts = [pose]
    for axis in _sphere_axes(n_tilts):
        twist = np.concatenate([np.zeros(3), np.radians(tilt_deg) * axis])
        starts.append(pose.moved(twist, centre))
    return starts


def find_candidates(
    cloud: SurfaceCloud,
    model: RegistrationModel,
    starts: Sequence[RigidTransform],
    score: Callable[[PoseEstimate], float],
    on_progress: Callable[[float], None] = lambda share: None,
) -> list[PoseEstimate]:
    """Fit from every start on a thinned cloud; distinct answers, best score first.

    Args:
        cloud: measured points around the bone.
        model: prepared bone.
        starts: `rectified_from_bone` each.
        score: larger is better; asked once for each distinct answer.
        on_progress: told the share done; may raise to cancel.
    """
    thinned = cloud.selected(_thin(len(cloud), _COARSE_POINTS))
    found: list[PoseEstimate] = []
    for number, start in enumerate(starts):
        on_progress(number / len(starts))
        estimate = fit_point_to_plane(thinned, model, start, _COARSE)
        if np.isfinite(estimate.covariance).all():
            found.append(estimate)
    on_progress(1.0)
    return sorted(distinct(found, model.centre_mm), key=score, reverse=True)


def distinct(estimates: Sequence[PoseEstimate], centre_mm: FloatArray) -> list[PoseEstimate]:
    """Without those that repeat an earlier answer."""
    kept: list[PoseEstimate] = []
    for estimate in estimates:
        pose = estimate.camera_from_bone
        if not any(is_same_pose(pose, other.camera_from_bone, centre_mm) for other in kept):
            kept.append(estimate)
    return kept


def is_same_pose(a: RigidTransform, b: RigidTransform, centre_mm: FloatArray) -> bool:
    """Whether two answers differ by less than a fit's basin."""
    shift = float(np.linalg.norm(a.apply(centre_mm) - b.apply(centre_mm)))
    turn = float(np.linalg.norm(a.rotation - b.rotation)) / np.sqrt(2.0)
    return shift < _SAME_MM and turn < _SAME_RAD


def _sphere_axes(n: int) -> FloatArray:
    """(n, 3) unit vectors of a golden spiral."""
    k = np.arange(n) + 0.5
    z = 1.0 - 2.0 * k / max(n, 1)
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    radius = np.sqrt(np.maximum(0.0, 1.0 - z * z))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


def _thin(n: int, wanted: int) -> np.ndarray:
    """Indices of about `wanted` of n points, evenly spread, always the same."""
    return np.arange(n) if n <= wanted else np.linspace(0, n - 1, wanted).astype(np.intp)
