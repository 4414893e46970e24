"""The plane of a known face: how a bone goes with it, and how measured points lie about it."""

from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tracking.surface_meter import Measurement
from navapp.values import MeasuredFace, PoseEstimate

# All chosen. Width of the kernel in deviations, and the least deviation.
_KERNEL_SIGMAS, _LEAST_MM = 2.5, 0.03
# Points further off the plane are of something else; fewer fix no plane.
_FURTHEST_MM, _FEWEST = 4.0, 60


def face_twists(
    face: MeasuredFace, pose: RigidTransform, centre_mm: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Twists by which a bone goes with its face, and those that leave the face's plane as it is.

    Args:
        face: of the bone.
        pose: camera from bone.
        centre_mm: (3,) the model's centre in the bone; the twists are about it.

    Returns:
        (6, 3) of both tilts (rad) and the offset (mm); (6, 3) of shifts along both axes (mm) and of
        the turn about the normal (rad).
    """
    normal = pose.rotate(face.normal[None])[0]
    axes = pose.rotate(face.plane.axes)
    arm_mm = pose.apply(face.plane.point_mm[None])[0] - pose.apply(centre_mm)

    def turn_about_point(axis: FloatArray) -> FloatArray:
        """About the planned point, which moves the model's centre."""
        return np.concatenate([np.cross(axis, -arm_mm), axis])

    none = np.zeros(3)
    tilts = [turn_about_point(np.cross(normal, axis)) for axis in axes]
    shifts = [np.concatenate([axis, none]) for axis in axes]
    fixed = np.stack([*tilts, np.concatenate([normal, none])], axis=1)
    return fixed, np.stack([*shifts, turn_about_point(normal)], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class FaceHeights:
    """How high measured points lie over a face, away from the bone."""

    points_mm: FloatArray  # (N, 3) in the camera
    height_mm: FloatArray  # (N,)
    sigma_mm: FloatArray  # (N,) of the heights

    @classmethod
    def of(
        cls, measured: Measurement, face: MeasuredFace, pose: RigidTransform, roughness: float
    ) -> "FaceHeights | None":
        """Of what was measured near a face.

        Args:
            measured: surface.
            face: of the bone.
            pose: camera from bone.
            roughness: deviation of the points over the one that they claim.

        Returns:
            None with too few points.
        """
        cloud, normal = measured.cloud, pose.rotate(face.normal[None])[0]
        height_mm = (cloud.points_mm - pose.apply(face.point_mm[None])[0]) @ normal
        is_near = np.abs(height_mm) < _FURTHEST_MM
        if np.count_nonzero(is_near) < _FEWEST:
            return None
        points_mm = cloud.points_mm[is_near]
        # Errors lie along the rays.
        cosine = np.abs(points_mm @ normal) / np.linalg.norm(points_mm, axis=1)
        sigma_mm = roughness * cosine * cloud.sigma_ray_mm[is_near].astype(np.float64)
        return cls(points_mm, height_mm[is_near], sigma_mm)

    def less(self, by_mm: FloatArray) -> "FaceHeights":
        """Over a face that lies so much higher at each point (N,)."""
        return replace(self, height_mm=self.height_mm - by_mm)

    @property
    def weight(self) -> FloatArray:
        """(N,) of the points, under a kernel as wide as they scatter."""
        scatter_mm = 1.4826 * float(np.median(np.abs(self.height_mm)))
        width_mm = _KERNEL_SIGMAS * max(scatter_mm, _LEAST_MM)
        weight: FloatArray = np.exp(-0.5 * (self.height_mm / width_mm) ** 2)
        return weight

    def describe(self, pose: RigidTransform, covariance: FloatArray) -> PoseEstimate:
        """A pose with a covariance (6, 6), and the heights as its residuals."""
        weight = self.weight / self.weight.sum()
        rms_mm, claimed_mm = (
            float(np.sqrt(weight @ one**2)) for one in (self.height_mm, self.sigma_mm)
        )
        return PoseEstimate(
            pose,
            covariance,
            n_points=len(self.height_mm),
            inlier_fraction=float(np.mean(np.abs(self.height_mm) < 3.0 * self.sigma_mm)),
            rms_mm=rms_mm,
            expected_rms_mm=claimed_mm,
            iterations=1,
            is_converged=True,  # a search that does not rest says so
        )
