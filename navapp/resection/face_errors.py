"""A plane in the cameras becomes a face in the bone, with what makes it unsure."""

import numpy as np

from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.rig import RigQuality
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.resection.face_fit import DisparityPlane, plane_in_camera
from navapp.values import BoneModel, MeasuredFace, PoseEstimate, ResectionPlane

# Chosen: errors that all of a bone's surface shares turn a pose by as much as they are over this
# length.
_LEVER_MM = 30.0
# Of the differences by which the pose's covariance is propagated.
_STEP_MM, _STEP_RAD = 1e-3, 1e-5


def make_face(
    fit: DisparityPlane,
    geometry: RectifiedGeometry,
    estimate: PoseEstimate,
    bone: BoneModel,
    quality: RigQuality | None,
    planned: ResectionPlane,
    seen_share: float,
) -> MeasuredFace:
    """The face of a cut from its plane in a rectified pair.

    Args:
        fit: of that plane.
        geometry: of the pair.
        estimate: of the bone's pose in the left camera before rectification.
        bone: as planned: how far its surface and its cartilage may be off.
        quality: how far the rig may be off; None: it is taken as it is.
        planned: the cut.
        seen_share: of the whole face, 0 to 1.
    """
    left_from_bone = estimate.camera_from_bone
    centre_mm = left_from_bone.apply(bone.mesh.centroid_mm[None])[0]
    turn = geometry.rectified_from_left.inverse().rotation

    def describe(coefficients: FloatArray, pose: RigidTransform) -> FloatArray:
        normal, distance_mm = plane_in_camera(coefficients, geometry)
        return _tilts_offset(turn @ normal, distance_mm, pose, planned)

    value = describe(fit.coefficients, left_from_bone)
    deviation = np.sqrt(np.diag(fit.covariance))
    by_fit = np.stack(
        [
            (describe(fit.coefficients + d * axis, left_from_bone) - value) / d
            for d, axis in zip(0.1 * deviation, np.eye(3), strict=True)
        ],
        axis=1,
    )
    steps = np.repeat([_STEP_MM, _STEP_RAD], 3)
    by_pose = np.stack(
        [
            (describe(fit.coefficients, left_from_bone.move(d * axis, centre_mm)) - value) / d
            for d, axis in zip(steps, np.eye(6), strict=True)
        ],
        axis=1,
    )
    of_pose = estimate.covariance_at(left_from_bone.apply(planned.point_mm) - centre_mm)
    covariance = by_fit @ fit.covariance @ by_fit.T + by_pose @ of_pose @ by_pose.T
    covariance += np.diag(_common_sd(estimate, bone, quality) ** 2)
    return MeasuredFace(planned, value, covariance, seen_share)


def _common_sd(estimate: PoseEstimate, bone: BoneModel, quality: RigQuality | None) -> FloatArray:
    """(3,) of tilts and offset: what the plan's surface and the rig add to any pose's error."""
    sd_mm = find_common_sd_mm(estimate, bone, quality)
    return np.array([sd_mm / _LEVER_MM, sd_mm / _LEVER_MM, sd_mm])


def find_common_sd_mm(estimate: PoseEstimate, bone: BoneModel, quality: RigQuality | None) -> float:
    """By how much the plan's surface, its cartilage and the rig may be off at a bone.

    A cartilage whose thickness was fitted is in the covariance of the pose.
    """
    depth_mm = float(estimate.camera_from_bone.apply(bone.mesh.centroid_mm[None])[0, 2])
    is_known = estimate.thickness_ratio is not None
    cartilage_mm = 0.0 if is_known else float(np.sqrt(np.mean(bone.cartilage_sd_mm**2)))
    # Told as a 95 % bound.
    rig_mm = 0.0 if quality is None else 0.5 * quality.error_mm(depth_mm)
    return float(np.sqrt(cartilage_mm**2 + bone.surface_sd_mm**2 + rig_mm**2))


def _tilts_offset(
    normal: FloatArray, distance_mm: float, left_from_bone: RigidTransform, planned: ResectionPlane
) -> FloatArray:
    """(3,) as of `MeasuredFace`, of the plane N . X = distance in the left camera."""
    in_bone = left_from_bone.inverse().rotate(normal[None])[0]
    tilts = planned.axes @ in_bone / float(in_bone @ planned.normal)
    offset_mm = distance_mm - float(normal @ left_from_bone.apply(planned.point_mm[None])[0])
    return np.array([*tilts, offset_mm])
