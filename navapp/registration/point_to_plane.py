"""Robust point-to-plane registration: the line's first estimator.

Pairs go from measured points to the nearest model point whose normal faces the camera. Each pair's
residual is the distance along that normal; a Welsch weight takes out what is not bone. The search
radius shrinks in stages; the last one uses the noise itself as the weight's width.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.model import RegistrationModel
from navapp.values import PoseEstimate, Reason, SurfaceCloud

# A length that makes rotations (rad) and translations (mm) comparable in the equations.
_LEVER_MM = 30.0
MIN_POINTS = 60


@dataclass(frozen=True, slots=True)
class PointToPlaneSettings:
    """How the estimator works.

    Attributes:
        radii_mm: search radius of each stage.
        max_iterations: of one stage.
        step_mm, step_rad: a smaller step ends a stage.
        correlation_px: distance over which the matcher's errors go together; neighbouring points
            within it count as one measurement. The default is for surfaces measured without a
            model: with a margin for smooth bone and for tissue that lies flush with it.
        degenerate_share: smallest over largest eigenvalue of the information below which a
            direction counts as free.
    """

    radii_mm: tuple[float, ...] = (10.0, 4.0, 2.0)
    max_iterations: int = 30
    step_mm: float = 0.01
    step_rad: float = 2e-4
    correlation_px: float = 40.0
    degenerate_share: float = 5e-3


class _Pairs(NamedTuple):
    """Pairs at a pose, in bone coordinates."""

    points_mm: FloatArray
    normals: FloatArray
    residual_mm: FloatArray
    variance_mm2: FloatArray
    vertex: np.ndarray
    stride_px: int


def fit_point_to_plane(
    cloud: SurfaceCloud,
    model: RegistrationModel,
    rectified_from_bone: RigidTransform,
    settings: PointToPlaneSettings | None = None,
) -> PoseEstimate:
    """Fit the model to a measured surface from a start.

    Args:
        cloud: points in the rectified left camera.
        model: prepared bone.
        rectified_from_bone: start.
        settings: of the estimator.

    Returns:
        The pose `rectified_from_bone` with covariance and reasons; never the start in disguise:
        when too few points pair, the reasons say so.

    Source: Chen and Medioni 1992; Welsch weight w = exp(-r^2 / 2 s^2).
    """
    settings = settings or PointToPlaneSettings()
    pose = rectified_from_bone
    iterations, is_converged = 0, False
    for radius_mm in settings.radii_mm:
        is_converged = False
        for _ in range(settings.max_iterations):
            pairs = _pair(cloud, model, pose, radius_mm)
            if len(pairs.vertex) < MIN_POINTS:
                return estimate_at(cloud, model, pose, iterations, False, settings)
            iterations += 1
            weight = _weights(pairs, radius_mm)
            pose, turn_rad, shift_mm = _step(pairs, weight, pose)
            if shift_mm < settings.step_mm and turn_rad < settings.step_rad:
                is_converged = True
                break
    return estimate_at(cloud, model, pose, iterations, is_converged, settings)


def estimate_at(
    cloud: SurfaceCloud,
    model: RegistrationModel,
    rectified_from_bone: RigidTransform,
    iterations: int = 0,
    is_converged: bool = True,
    settings: PointToPlaneSettings | None = None,
) -> PoseEstimate:
    """How well a pose fits a measured surface, without moving it."""
    settings = settings or PointToPlaneSettings()
    pairs = _pair(cloud, model, rectified_from_bone, settings.radii_mm[-1])
    reasons = [] if is_converged else [Reason.NOT_CONVERGED]
    if len(pairs.vertex) < MIN_POINTS:
        return PoseEstimate(
            rectified_from_bone, np.diag([np.inf] * 6), len(pairs.vertex), 0.0, np.inf, np.inf,
            iterations, False, (Reason.TOO_FEW_POINTS,),
        )  # fmt: skip
    weight = np.exp(-0.5 * pairs.residual_mm**2 / _width_mm2(pairs, settings.radii_mm[-1]))
    total = weight.sum()
    inlier_share = float((np.abs(pairs.residual_mm) < 3.0 * np.sqrt(pairs.variance_mm2)).mean())
    covariance, is_degenerate = _covariance(
        pairs, weight, rectified_from_bone, model.centre_mm, settings
    )
    if is_degenerate:
        reasons.append(Reason.DEGENERATE)
    return PoseEstimate(
        rectified_from_bone,
        covariance,
        len(pairs.vertex),
        inlier_share,
        float(np.sqrt((weight * pairs.residual_mm**2).sum() / total)),
        float(np.sqrt((weight * pairs.variance_mm2).sum() / total)),
        iterations,
        is_converged,
        tuple(reasons),
    )


def _pair(
    cloud: SurfaceCloud, model: RegistrationModel, pose: RigidTransform, radius_mm: float
) -> _Pairs:
    """Nearest model points that face the camera."""
    bone_from_rectified = pose.inverse()
    points = bone_from_rectified.apply(cloud.points_mm)
    camera = bone_from_rectified.translation_mm
    index, distance = model.nearest(points, radius_mm)
    normals = model.normals[index]
    surface = model.points_mm[index]
    faces_camera = np.einsum("ij,ij->i", normals, surface - camera) <= 0.0
    kept = np.isfinite(distance) & faces_camera
    points, normals, index = points[kept], normals[kept], index[kept]
    rays = points - camera
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    along = np.einsum("ij,ij->i", normals, rays)
    variance = (along * cloud.sigma_ray_mm[kept]) ** 2 + model.sigma_mm[index] ** 2
    residual = np.einsum("ij,ij->i", normals, points - surface[kept])
    return _Pairs(points, normals, residual, variance, index, cloud.stride_px)


def _width_mm2(pairs: _Pairs, radius_mm: float) -> FloatArray:
    """Squared width of the weight: a quarter of the radius, but not below 1.6 times the noise.

    At 1.6 the Welsch estimator keeps 88 % of the efficiency that least squares has on pure noise.
    """
    width: FloatArray = np.maximum(2.56 * pairs.variance_mm2, (radius_mm / 4.0) ** 2)
    return width


def _weights(pairs: _Pairs, radius_mm: float) -> FloatArray:
    weight: FloatArray = (
        np.exp(-0.5 * pairs.residual_mm**2 / _width_mm2(pairs, radius_mm)) / pairs.variance_mm2
    )
    return weight


def _jacobian(pairs: _Pairs, centre_mm: FloatArray) -> FloatArray:
    """(N, 6) of the residual for a motion of the points: rotation / lever, then translation."""
    return np.hstack(
        [np.cross(pairs.points_mm - centre_mm, pairs.normals) / _LEVER_MM, pairs.normals]
    )


def _step(
    pairs: _Pairs, weight: FloatArray, pose: RigidTransform
) -> tuple[RigidTransform, float, float]:
    """One weighted Gauss-Newton step; the points move, so the pose takes the inverse."""
    centre = np.average(pairs.points_mm, axis=0, weights=weight)
    jacobian = _jacobian(pairs, centre)
    weighted = jacobian * weight[:, None]
    information = jacobian.T @ weighted
    damping = 1e-6 * np.trace(information) / 6.0
    delta = -np.linalg.solve(information + damping * np.eye(6), weighted.T @ pairs.residual_mm)
    turn, shift = delta[:3] / _LEVER_MM, delta[3:]
    turn *= min(1.0, 0.25 / max(float(np.linalg.norm(turn)), 1e-12))
    shift *= min(1.0, 10.0 / max(float(np.linalg.norm(shift)), 1e-12))
    moved = pose.inverse().moved(np.concatenate([shift, turn]), centre)
    return moved.inverse(), float(np.linalg.norm(turn)), float(np.linalg.norm(shift))


def _covariance(
    pairs: _Pairs,
    weight: FloatArray,
    pose: RigidTransform,
    centre_mm: FloatArray,
    settings: PointToPlaneSettings,
) -> tuple[FloatArray, bool]:
    """Covariance of the public twist, and whether a direction is free.

    The twist of the points about the model's centre becomes the pose's own by a change of sign and
    the rotation into the camera's frame.
    """
    jacobian = _jacobian(pairs, centre_mm)
    scaled = jacobian * (weight / pairs.variance_mm2)[:, None]
    information = jacobian.T @ scaled
    eigenvalues = np.linalg.eigvalsh(information)
    if eigenvalues[0] <= 1e-9 * eigenvalues[-1]:
        return np.diag([np.inf] * 6), True
    shared = max(1.0, (settings.correlation_px / pairs.stride_px) ** 2)
    covariance = shared * np.linalg.inv(information)
    # From (rotation / lever, translation) in the bone's frame to the public order and frame.
    change = np.zeros((6, 6))
    change[:3, 3:] = pose.rotation
    change[3:, :3] = pose.rotation / _LEVER_MM
    return change @ covariance @ change.T, bool(
        eigenvalues[0] < settings.degenerate_share * eigenvalues[-1]
    )
