"""A pose, what stands behind it, and what the judge says of it."""

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform, twist_slopes
from navapp.values.measured import Foreground, RowCheck
from navapp.values.timings import FrameTimings


class Reason(Enum):
    """Why a pose is not good, or why nothing is shown. The value is the phrase for people."""

    # of the judge
    NO_SURFACE = "no surface was measured where the bone should be"
    TOO_FEW_POINTS = "too few points on the bone"
    COVERAGE_LOW = "too little of the bone is seen"
    SEEN_THROUGH = "something is seen where the bone should be in the way"
    SURFACE_MISFIT = "surface does not fit the model"
    SIZE_DIFFERS = "the bone seen has another size than the model"
    OUTLIERS = "too many points fit no surface of the model"
    NOT_CONVERGED = "the estimate did not settle"
    AMBIGUOUS = "a different pose fits as well"
    CUES_DISAGREE = "surface and outline do not agree"
    DEGENERATE = "the seen surface leaves a direction free"
    POSE_UNCERTAIN = "the seen surface fixes the pose too loosely"
    MOTION_UNKNOWN = "how the bone moved while the pictures were taken is not known"
    CARTILAGE_UNCERTAIN = "the plan knows the cartilage too roughly"
    TRE_TOO_LARGE = "the predicted error exceeds the stage's tolerance"
    JUMPED = "the pose jumped further than a patient moves"
    ROWS_DISAGREE = "the cameras' rows do not agree: has the rig moved?"
    PICTURE_DARK = "one picture is dark or blocked"
    PICTURE_OVEREXPOSED = "one picture is overexposed"
    PICTURES_UNLIKE = "one picture is blurred or covered"
    PICTURES_SWAPPED = "left and right pictures are swapped"
    OTHER_SIDE = "the other side's bone fits better: is it the other knee's plan?"
    RIG_NOT_ACCEPTED = "the rig's calibration was not accepted"
    OUT_OF_VIEW = "the bone is outside the picture"
    # of the session
    NOT_NAVIGATING = "no registration has been accepted"
    BONE_LOST = "the bone is lost"
    BLANKED = "blanked by the operator"
    CAMERA_SILENT = "the camera sends no picture"
    DEVICE_FAULT = "a device has failed"
    RIG_MOVED = "rig moved, recalibrate"
    MIRROR_AWAY = "the mirror does not stand where the display was calibrated"
    PROJECTOR_ALTERS = "the projector alters the picture"
    PROJECTOR_LOST = "the projector does not answer"
    DISPLAY_DIFFERS = "the display is not as calibrated in the mirror"
    DISPLAY_NOT_ACCEPTED = "the calibration of the mirror was not accepted"
    DISPLAY_EXPIRED = "the calibration of the mirror has expired"
    MOVES_TOO_FAST = "the bone moves too fast for the display"
    OTHER_EYE = "guides are more than 1 mm off for the other eye"
    MIRROR_INEXACT = "guides in the mirror may be off by more than the stage allows"
    MIRROR_UNCHECKED = "nobody has checked what is seen in the mirror"
    MIRROR_CHECK_FAILED = "the check of the mirror has failed"
    MIRROR_CHECK_OLD = "the check of the mirror is too old"
    POSE_TOO_OLD = "the pose is too old"
    TOO_SLOW = "this computer is too slow for guides"
    STAGE_WITHOUT_BONE = "the plan has no model of this stage's bone"
    CHECK_FAILED = "the check on the patient failed"
    TIME_OUT_OPEN = "the time-out checklist is not done"

    @property
    def remedy(self) -> str:
        """What the operator can do."""
        return _REMEDIES[self]


_REMEDIES = {
    Reason.NO_SURFACE: "aim the cameras at the bone, or check the light",
    Reason.TOO_FEW_POINTS: "clear the view, or check the light",
    Reason.COVERAGE_LOW: "move the instrument or hand away",
    Reason.SEEN_THROUGH: "check that this is the right bone and plan; register again",
    Reason.SURFACE_MISFIT: "check that this is the right bone and plan; register again",
    Reason.SIZE_DIFFERS: "check that this is the right plan, and its scale",
    Reason.OUTLIERS: "clear the view of the bone; register again",
    Reason.NOT_CONVERGED: "hold still, or register again",
    Reason.AMBIGUOUS: "expose more of the bone, or start nearer to it",
    Reason.CUES_DISAGREE: "check that this is the right bone and plan; register again",
    Reason.DEGENERATE: "expose more of the bone",
    Reason.POSE_UNCERTAIN: "move the instrument or hand away, or expose more of the bone",
    Reason.MOTION_UNKNOWN: "hold still; cameras that expose all rows at once do not need it",
    Reason.CARTILAGE_UNCERTAIN: "give the plan a surface of the cartilage",
    Reason.TRE_TOO_LARGE: "expose more of the bone, or come closer",
    Reason.JUMPED: "wait for the next frames, or register again",
    Reason.ROWS_DISAGREE: "hold still; if it stays, calibrate the rig again",
    Reason.PICTURE_DARK: "uncover both cameras, or check the light",
    Reason.PICTURE_OVEREXPOSED: "turn the light or the exposure down",
    Reason.PICTURES_UNLIKE: "clean and uncover both cameras",
    Reason.PICTURES_SWAPPED: "swap the cameras' cables, or their names in the settings",
    Reason.OTHER_SIDE: "check the patient, the side and the plan; load the right one",
    Reason.RIG_NOT_ACCEPTED: "calibrate the rig again",
    Reason.OUT_OF_VIEW: "bring the bone back into both pictures",
    Reason.NOT_NAVIGATING: "register, then accept the candidate",
    Reason.BONE_LOST: "clear the view; it is searched for where it was last seen",
    Reason.BLANKED: "press the show key to leave blank",
    Reason.CAMERA_SILENT: "check the camera's cable",
    Reason.DEVICE_FAULT: "see the events, then check the device",
    Reason.RIG_MOVED: "end the session; check the rig on the board, or calibrate it",
    Reason.MIRROR_AWAY: "reopen brings it back; keep hands off, see the devices",
    Reason.PROJECTOR_ALTERS: "set flips, keystone, freeze and source back on the projector",
    Reason.PROJECTOR_LOST: "check its mains, its lamp and its control cable",
    Reason.DISPLAY_DIFFERS: "set its size and flips back, or calibrate",
    Reason.DISPLAY_NOT_ACCEPTED: "calibrate the mirror again",
    Reason.DISPLAY_EXPIRED: "calibrate the mirror again",
    Reason.MOVES_TOO_FAST: "hold the leg still until it is shown again",
    Reason.OTHER_EYE: "cover it and say so ([mirror] eyes), or move the display",
    Reason.MIRROR_INEXACT: "bring the display's picture nearer to the bone, or calibrate again",
    Reason.MIRROR_UNCHECKED: "check it on three corners of a board, or points of the bone",
    Reason.MIRROR_CHECK_FAILED: "look from the calibrated place and check again, or calibrate",
    Reason.MIRROR_CHECK_OLD: "check it again on three corners or points",
    Reason.POSE_TOO_OLD: "wait for the next frame",
    Reason.TOO_SLOW: "end other programs, or use a faster computer",
    Reason.STAGE_WITHOUT_BONE: "add the bone's surface to the plan",
    Reason.CHECK_FAILED: "register again, or check again on the page of the tools (u)",
    Reason.TIME_OUT_OPEN: "confirm patient, side and plan on the page of the gates",
}


# What stays wrong until somebody mends it: told in front of the reasons of a bone that is not OK.
CAUSES = (Reason.PICTURES_SWAPPED, Reason.OTHER_SIDE)


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
    # (7, 7) as `covariance`: what the bone's relief adds to it.
    relief_covariance: FloatArray = field(default_factory=lambda: np.zeros((7, 7)))

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
        by_growth: FloatArray = self.growth_mm / self.lever_mm * (self.arm_mm + offsets_mm)
        return twist_slopes(offsets_mm) @ self.step[:6] + by_growth

    def twist_at(self, offset_mm: FloatArray) -> FloatArray:
        """(6,) twist that shifts a point as that size does, and turns the bone as it does.

        Args:
            offset_mm: (3,) from the model's centre to the point.
        """
        by_growth_mm = self.growth_mm / self.lever_mm * (self.arm_mm + offset_mm)
        twist: FloatArray = self.step[:6] + np.concatenate([by_growth_mm, np.zeros(3)])
        return twist

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
            relief_covariance=change @ self.relief_covariance @ change.T,
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
    # (6, 6) as `covariance`: what the bone's relief adds to it, which no model knows.
    relief_covariance: FloatArray = field(default_factory=lambda: np.zeros((6, 6)))
    # The pose in the size that is seen; what it shifts points by is in all predicted errors. None
    # where the size is taken as it is: of what was not measured on the model.
    sized: SizedPose | None = None

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

    def with_relief(self, times: float) -> "PoseEstimate":
        """The same with so many times the bone's relief in the covariances of pose and size."""
        sized = self.sized
        if sized is not None:
            sized = replace(
                sized,
                covariance=sized.covariance + times * sized.relief_covariance,
                relief_covariance=np.zeros((7, 7)),
            )
        return replace(
            self,
            covariance=self.covariance + times * self.relief_covariance,
            relief_covariance=np.zeros((6, 6)),
            sized=sized,
        )

    def turn_camera(self, turned: RigidTransform) -> "PoseEstimate":
        """The same in a camera `turned` (from the old one) about its centre."""
        moved = replace(self, camera_from_bone=turned @ self.camera_from_bone)
        if not self.has_finite_covariance:
            return moved
        turn = np.kron(np.eye(2), turned.rotation)
        return replace(
            moved,
            covariance=turn @ self.covariance @ turn.T,
            relief_covariance=turn @ self.relief_covariance @ turn.T,
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


class Status(Enum):
    """The judge's word on a pose."""

    OK = "OK"
    DEGRADED = "DEGRADED"
    LOST = "LOST"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The judge's answer for one frame."""

    status: Status  # only OK may be shown
    # 95 % bound of the mean error over the stage's targets, or over the visible vertices when the
    # plan names no targets; None without a pose.
    predicted_tre_mm: float | None = None
    reasons: tuple[Reason, ...] = ()  # why it is not OK
    coverage: float = 0.0  # share of the visible model that was measured and fits
    occluded_fraction: float = 0.0  # share of the visible model that something nearer hides
    inlier_fraction: float = 0.0  # share of the measured, not hidden model pixels that fit
    # rms_mm, expected_rms_mm: of the residual.
    rms_mm: float | None = None
    expected_rms_mm: float | None = None
    spread_ratio: float = 0.0  # spread of the differences to the model over the sigma they claim

    @property
    def cause(self) -> Reason | None:
        """What is wrong for good, when that was found out."""
        return next((reason for reason in self.reasons if reason in CAUSES), None)

    @property
    def rank(self) -> tuple[int, bool, float]:
        """Smaller is better: by status, then not ambiguous, then by coverage."""
        return list(Status).index(self.status), Reason.AMBIGUOUS in self.reasons, -self.coverage


@dataclass(frozen=True, slots=True, eq=False)
class TrackedFrame:
    """What a tracker answers for one frame and one bone."""

    bone: str  # its name
    estimate: PoseEstimate | None  # of its pose, None without one
    verdict: Verdict  # of the judge
    timings: FrameTimings  # of the tracker's steps
    rows: RowCheck | None = None  # what the pair says of the rig itself; None when it says nothing
    foreground: Foreground | None = None  # at the pose; None without one
    is_matte: bool = False  # measured in pictures without highlights

    @property
    def left_from_bone(self) -> RigidTransform | None:
        """The pose, when there is one."""
        return None if self.estimate is None else self.estimate.camera_from_bone

    def with_cause(self, cause: Reason | None) -> "TrackedFrame":
        """The same answer with the cause of its failure in front; an OK has none."""
        if cause is None or self.verdict.status is Status.OK:
            return self
        others = tuple(reason for reason in self.verdict.reasons if reason is not cause)
        return replace(self, verdict=replace(self.verdict, reasons=(cause, *others)))

    @property
    def rows_disagree(self) -> bool:
        """Whether the cameras' rows surely do: no pose of this pair is OK then."""
        return self.rows is not None and self.rows.is_off
