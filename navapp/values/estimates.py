"""An estimated pose of a bone, how well it is fixed, and what that means for points of the bone."""

from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform, twist_slopes
from navapp.values.reasons import Reason


@dataclass(frozen=True, slots=True, eq=False)
class SizedPose:
    """Pose and size of a bone, fitted together, relative to the pose with the model's own size.

    The model grows about the middle of what is seen of it.
    """

    # (7,) from the pose with the model's own size: twist as of `PoseEstimate.covariance`, growth in
    # mm at the lever.
    step: FloatArray
    covariance: FloatArray  # (7, 7) of it
    arm_mm: FloatArray  # (3,) from the middle of what is seen to the model's centre
    lever_mm: float  # rms distance of what is seen from its middle

    @property
    def growth_mm(self) -> float:
        """By how much the bone seems larger than its model, at the lever."""
        return float(self.step[6])

    @property
    def growth_sigma_mm(self) -> float:
        """Standard deviation of that."""
        return float(np.sqrt(self.covariance[6, 6]))

    def shifts_mm(self, offsets_mm: FloatArray) -> FloatArray:
        """(N, 3) by how much points lie elsewhere in that size.

        Args:
            offsets_mm: (N, 3) from the model's centre to the points.
        """
        shifts_mm: FloatArray = twist_slopes(offsets_mm) @ self.step[:6]
        return shifts_mm + self._grow_mm(offsets_mm)

    def twist_at(self, offset_mm: FloatArray) -> FloatArray:
        """(6,) twist that shifts a point as that size does, and turns the bone as it does.

        Args:
            offset_mm: (3,) from the model's centre to the point.
        """
        twist: FloatArray = self.step[:6] + np.append(self._grow_mm(offset_mm), np.zeros(3))
        return twist

    def _grow_mm(self, offsets_mm: FloatArray) -> FloatArray:
        """(..., 3) shifts by growth alone."""
        return self.growth_mm / self.lever_mm * (self.arm_mm + offsets_mm)

    def scale_noise(self, variance_ratio: float) -> "SizedPose":
        """The same with a covariance so many times as large."""
        return replace(self, covariance=variance_ratio * self.covariance)

    def turn(self, rotation: FloatArray) -> "SizedPose":
        """The same in a frame that is turned by `rotation` (3, 3)."""
        change = np.eye(7)
        change[:3, :3] = change[3:6, 3:6] = rotation
        return replace(
            self,
            step=change @ self.step,
            covariance=change @ self.covariance @ change.T,
            arm_mm=rotation @ self.arm_mm,
        )

    def seen_from(self, twist: FloatArray) -> "SizedPose":
        """The same pose and size, relative to a pose that was moved by `twist` (6,)."""
        return replace(self, step=self.step - np.append(twist, 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class PoseEstimate:
    """A bone's pose and how well the measurement fixes it."""

    # source the bone's name; target `left_rect` inside a tracker, `left` (before rectification)
    # outside of it.
    camera_from_bone: RigidTransform
    # (6, 6) of the twist (translation mm first, rotation rad second), applied from the left about
    # the mean of the model's vertices. Of a bone in the model's own size.
    covariance: FloatArray
    n_points: int  # points that entered
    inlier_fraction: float  # their share within three sigma of the surface
    rms_mm: float  # weighted rms of the point-to-plane residual of those
    expected_rms_mm: float  # what the measurement's own sigma predicts for it
    iterations: int  # of the solver
    is_converged: bool  # the last step was small enough
    reasons: tuple[Reason, ...] = ()  # what the solver itself has against the result
    # The pose in the size that is seen; what it shifts points by is in all predicted errors. None
    # where the size is taken as it is: of what was not measured on the model.
    sized: SizedPose | None = None
    # rms of what the seen cartilage is thicker or thinner than planned, over the deviation that the
    # plan claims. None: thickness was not fitted, and the covariance knows nothing of its errors.
    thickness_ratio: float | None = None

    @property
    def has_finite_covariance(self) -> bool:
        """Whether the measurement fixes the pose in all directions."""
        return bool(np.isfinite(self.covariance).all())

    def with_reason(self, reason: Reason) -> "PoseEstimate":
        """The same estimate with one more reason against it."""
        return replace(self, reasons=(*self.reasons, reason))

    def scale_noise(self, variance_ratio: float) -> "PoseEstimate":
        """The same with covariances of pose and size so many times as large."""
        sized = None if self.sized is None else self.sized.scale_noise(variance_ratio)
        return replace(self, covariance=variance_ratio * self.covariance, sized=sized)

    def turn_camera(self, turned: RigidTransform) -> "PoseEstimate":
        """The same in a camera that is turned about its centre.

        Args:
            turned: that camera from this one.
        """
        moved = replace(self, camera_from_bone=turned @ self.camera_from_bone)
        if not self.has_finite_covariance:  # turned, infinity would be no number
            return moved
        turn = np.kron(np.eye(2), turned.rotation)
        return replace(
            moved,
            covariance=turn @ self.covariance @ turn.T,
            sized=None if self.sized is None else self.sized.turn(turned.rotation),
        )

    def covariance_at(self, offset_mm: FloatArray) -> FloatArray:
        """(6, 6) as `covariance`, and what the seen size shifts a place and turns the bone by.

        Args:
            offset_mm: (3,) from the model's centre to the place, in the camera's frame.
        """
        if self.sized is None:
            return self.covariance
        twist = self.sized.twist_at(offset_mm)
        return self.covariance + np.outer(twist, twist)

    @property
    def rotation_covariance(self) -> FloatArray:
        """(3, 3) rad^2 of its turn, with what the seen size turns the bone by."""
        return self.covariance_at(np.zeros(3))[3:, 3:]

    def predict_tre_mm(
        self, centre_mm: FloatArray, targets_mm: FloatArray, level: float = 0.95
    ) -> float:
        """Bound of the mean error over target points of a bone.

        Args:
            centre_mm: (3,) mean of the model's vertices, in bone coordinates.
            targets_mm: (N, 3) in bone coordinates.
            level: share of errors that it is to hold for.

        The mean length is at most the root mean square, whose square is a weighted sum of
        chi-squares: here one chi-square of the same mean and variance (Welch 1938, Satterthwaite
        1946).

        Source: e(p) = J x + s u(p), J = [I | -[p - c]x], x ~ N(0, S), u the shift of the point in
        the size that is seen, s ~ N(0, 1); mean |e|^2 = x^T M x with M = mean J^T J and s as a
        seventh of x.
        """
        from scipy.special import chdtri

        if len(targets_mm) == 0:
            raise ValueError("no targets to predict an error for")
        jacobian, covariance = self._predict(centre_mm, targets_mm)
        mean_square = np.einsum("nki,nkj->ij", jacobian, jacobian) / len(jacobian)
        errors = covariance @ mean_square
        first, second = float(np.trace(errors)), float(np.trace(errors @ errors))
        if first <= 0.0:
            return 0.0
        freedom = first**2 / second
        return float(np.sqrt(first / freedom * chdtri(freedom, 1.0 - level)))

    def predict_covariances(self, centre_mm: FloatArray, points_mm: FloatArray) -> FloatArray:
        """(N, 3, 3) mm^2 in the camera's frame, of points (N, 3) of the bone.

        Args:
            centre_mm: (3,) mean of the model's vertices, in bone coordinates.
            points_mm: in bone coordinates.
        """
        jacobian, covariance = self._predict(centre_mm, points_mm)
        covariances: FloatArray = jacobian @ covariance @ jacobian.transpose(0, 2, 1)
        return covariances

    def _predict(
        self, centre_mm: FloatArray, points_mm: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(N, 3, k) how points of the bone shift, and (k, k) covariance of what shifts them."""
        offsets_mm = (points_mm - centre_mm) @ self.camera_from_bone.rotation.T
        jacobian = twist_slopes(offsets_mm)
        if self.sized is None:
            return jacobian, self.covariance
        shifts_mm = self.sized.shifts_mm(offsets_mm)
        covariance = np.eye(7)
        covariance[:6, :6] = self.covariance
        return np.concatenate([jacobian, shifts_mm[:, :, None]], axis=2), covariance
