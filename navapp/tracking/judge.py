"""The judge: is this pose good enough to be shown?

A wrong pose is worse than none. The judge therefore looks at what did not enter the fit: how much
of the model that should be seen was measured and agrees, not only how well paired points agree.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.rig import RigQuality
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import RenderedView, render_rectified
from navapp.registration.model import RegistrationModel
from navapp.tracking.agreement import Agreement, compare
from navapp.tracking.motion import twist_between
from navapp.values import (
    DisparityMap,
    PoseEstimate,
    Reason,
    Status,
    Verdict,
    predicted_tre_mm,
    visible_vertices,
)

# Errors of a cartilage's thickness go together over much of a bone: no number of points averages
# them out, and the pose takes up to so many of their standard deviations (docs/accuracy.md).
_COMMON_ERROR = 2.0
# What navigation promises of an OK pose, at 95 %, beside what the plan says of its own cartilage.
OK_ERROR_MM = 0.5
_SURE_SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class JudgeLimits:
    """Bounds of the judge.

    None follows from a noise model. `coverage_ok` and `rms_ratio_ok` are from a study of right and
    wrong plans on phantom_a, which is no unseen test of them. `cartilage_sd_ok` was compared on
    the simulated knees of the table of cartilage: it lies between a map good to 0.4 mm and a mean
    good to 0.6 mm. The others were chosen; no measurement is recorded. What all of them let pass
    of wrong plans and of cartilage: docs/accuracy.md.

    Attributes:
        coverage_ok, coverage_lost: share of the model that nothing hides, measured and agreeing.
        seen_ok, seen_lost: the same of the whole visible model, hidden or not.
        behind_ok, behind_lost: share of the model through which the scene is seen.
        inlier_ok, inlier_lost: share of the measured model pixels that agree.
        spread_ok: spread of all differences over the sigma that they claim, which is 1 where the
            noise is as claimed.
        rms_ratio_ok, rms_ratio_lost: rms of the fit's residual over what its sigma predicts.
        cartilage_sd_ok: rms standard deviation, mm, of the cartilage over the seen surface.
        jump_mm, jump_deg: largest motion of the bone's centre from the prediction, and turn.
        max_bound_targets: about so many targets are used for the predicted error; for time alone.
    """

    coverage_ok: float = 0.4
    coverage_lost: float = 0.25
    seen_ok: float = 0.15
    seen_lost: float = 0.1
    behind_ok: float = 0.05
    behind_lost: float = 0.15
    inlier_ok: float = 0.8
    inlier_lost: float = 0.5
    spread_ok: float = 1.1
    rms_ratio_ok: float = 1.25
    rms_ratio_lost: float = 2.0
    cartilage_sd_ok: float = 0.45
    jump_mm: float = 12.0
    jump_deg: float = 10.0
    max_bound_targets: int = 200


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """What the judge measures a pose against.

    Attributes:
        targets_mm: (N, 3) of the stage, in bone coordinates.
        tolerance_mm: of the stage: all that is known against the pose must stay below it.
        seen_mm: what is seen must fix the pose at least so well. What the plan's own cartilage may
            cost goes on top, in squares: no better view mends it.
    """

    targets_mm: FloatArray
    tolerance_mm: float
    seen_mm: float = OK_ERROR_MM


class Judge:
    """Judges poses of one bone under one rig.

    Args:
        geometry: of the rectified rig.
        quality: what the calibration says of itself; without it the rig is taken as it is.
        limits: what keeps a pose from being OK.
    """

    def __init__(
        self,
        geometry: RectifiedGeometry,
        quality: RigQuality | None = None,
        limits: JudgeLimits | None = None,
    ) -> None:
        self._geometry = geometry
        self._is_rig_accepted = quality is None or quality.is_accepted
        self._quality = quality
        self._limits = limits or JudgeLimits()

    def agreement(
        self,
        model: RegistrationModel,
        rectified_from_bone: RigidTransform,
        measured: DisparityMap,
        coarse_px: NDArray[np.float32] | None = None,
        view: RenderedView | None = None,
    ) -> Agreement:
        """How much of the model that should be seen was measured, and agrees."""
        if view is None:
            view = self._render(model, rectified_from_bone, measured)
        return compare(view, model, measured, self._geometry, coarse_px)

    def judge(
        self,
        model: RegistrationModel,
        estimate: PoseEstimate,
        measured: DisparityMap,
        goal: Goal,
        predicted: RigidTransform | None = None,
        coarse_px: NDArray[np.float32] | None = None,
        agreement: Agreement | None = None,
    ) -> Verdict:
        """Status, reasons and predicted error of a pose.

        Args:
            model: prepared bone.
            estimate: in the rectified left camera.
            measured: disparity over the bone's box.
            goal: of the stage.
            predicted: pose expected by the motion model, for the jump test.
            coarse_px: (h, w) coarse disparity of whatever is in that box: what hides the bone, and
                what is seen through the model.
            agreement: of the model with the disparity, at the pose or next to it; compared when
                absent.
        """
        if not np.isfinite(estimate.covariance).all():
            return Verdict(Status.LOST, None, estimate.reasons or (Reason.DEGENERATE,))
        if agreement is None:
            agreement = self.agreement(model, estimate.camera_from_bone, measured, coarse_px)
        if agreement.n_visible == 0:
            return Verdict(Status.LOST, None, (Reason.OUT_OF_VIEW,))
        is_seen = visible_vertices(model.bone.mesh, estimate.camera_from_bone)
        cartilage_mm = _rms(model.bone.cartilage_sd_mm[is_seen])
        by_plan_mm = _COMMON_ERROR * math.hypot(cartilage_mm, model.bone.surface_sd_mm)
        by_view_mm = self._bound_mm(model, estimate, goal.targets_mm, is_seen)
        bound_mm = math.hypot(by_view_mm, by_plan_mm, self._by_rig_mm(model, estimate))
        doubts = self._doubts(estimate, agreement)
        doubts += [Reason.SIZE_DIFFERS] * _has_another_size(estimate, by_plan_mm)
        doubts += [Reason.POSE_UNCERTAIN] * bool(by_view_mm > np.hypot(goal.seen_mm, by_plan_mm))
        doubts += [Reason.CARTILAGE_UNCERTAIN] * (cartilage_mm > self._limits.cartilage_sd_ok)
        doubts += [Reason.TRE_TOO_LARGE] * (bound_mm > goal.tolerance_mm)
        doubts += [Reason.JUMPED] * self._has_jumped(model, estimate, predicted)
        is_lost = self._is_lost(estimate, agreement)
        return Verdict(
            Status.LOST if is_lost else (Status.DEGRADED if doubts else Status.OK),
            bound_mm,
            tuple(dict.fromkeys(doubts)),
            agreement.coverage,
            agreement.hidden_share,
            agreement.inlier_share,
            estimate.rms_mm,
            estimate.expected_rms_mm,
        )

    def _by_rig_mm(self, model: RegistrationModel, estimate: PoseEstimate) -> float:
        """What the calibration itself leaves at the bone."""
        depth_mm = float(estimate.camera_from_bone.apply(model.centre_mm)[2])
        return 0.0 if self._quality is None else self._quality.error_mm(depth_mm)

    def _doubts(self, estimate: PoseEstimate, agreement: Agreement) -> list[Reason]:
        """What keeps a pose from being OK, apart from the stage's own limits."""
        limits = self._limits
        ratio = estimate.rms_mm / estimate.expected_rms_mm
        doubts = list(estimate.reasons)
        is_little = (
            agreement.open_coverage < limits.coverage_ok or agreement.coverage < limits.seen_ok
        )
        is_misfit = ratio > limits.rms_ratio_ok or agreement.spread_ratio > limits.spread_ok
        doubts += [Reason.COVERAGE_LOW] * is_little
        doubts += [Reason.SEEN_THROUGH] * (agreement.behind_share > limits.behind_ok)
        doubts += [Reason.OUTLIERS] * (agreement.inlier_share < limits.inlier_ok)
        doubts += [Reason.SURFACE_MISFIT] * is_misfit
        doubts += [Reason.RIG_NOT_ACCEPTED] * (not self._is_rig_accepted)
        return doubts

    def is_elsewhere(self, agreement: Agreement) -> bool:
        """So little of the model agrees that the bone is not there."""
        limits = self._limits
        return (
            agreement.open_coverage < limits.coverage_lost
            or agreement.coverage < limits.seen_lost
            or agreement.behind_share > limits.behind_lost
            or agreement.inlier_share < limits.inlier_lost
        )

    def _is_lost(self, estimate: PoseEstimate, agreement: Agreement) -> bool:
        limits = self._limits
        return (
            self.is_elsewhere(agreement)
            or estimate.rms_mm / estimate.expected_rms_mm > limits.rms_ratio_lost
            or Reason.TOO_FEW_POINTS in estimate.reasons
        )

    def _has_jumped(
        self,
        model: RegistrationModel,
        estimate: PoseEstimate,
        predicted: RigidTransform | None,
    ) -> bool:
        if predicted is None:
            return False
        shift_mm, turn_rad = np.split(
            twist_between(predicted, estimate.camera_from_bone, model.centre_mm), 2
        )
        is_far = np.linalg.norm(shift_mm) > self._limits.jump_mm
        return bool(is_far or np.linalg.norm(turn_rad) > np.radians(self._limits.jump_deg))

    def _render(
        self, model: RegistrationModel, pose: RigidTransform, measured: DisparityMap
    ) -> RenderedView:
        return render_rectified(
            model.drawn_mesh, pose, self._geometry, measured.box, is_closed=model.is_closed
        )

    def _bound_mm(
        self,
        model: RegistrationModel,
        estimate: PoseEstimate,
        targets_mm: FloatArray,
        is_seen: NDArray[np.bool_],
    ) -> float:
        """Of the measurement alone; over what is seen when there are no targets."""
        if len(targets_mm) > 0:
            points_mm, index = targets_mm, np.arange(len(targets_mm))
        else:
            points_mm, index = model.bone.mesh.vertices_mm, np.flatnonzero(is_seen)
        if len(index) == 0:
            return float("inf")
        step = max(1, len(index) // self._limits.max_bound_targets)
        return predicted_tre_mm(estimate, model.centre_mm, points_mm[index[::step]])


def within_tolerance(verdict: Verdict, goal: Goal) -> Verdict:
    """A verdict whose error was widened since: no longer OK where it exceeds what is tolerated."""
    bound_mm = verdict.predicted_tre_mm
    if verdict.status is not Status.OK or bound_mm is None or bound_mm <= goal.tolerance_mm:
        return verdict
    return replace(
        verdict, status=Status.DEGRADED, reasons=(*verdict.reasons, Reason.TRE_TOO_LARGE)
    )


def _has_another_size(estimate: PoseEstimate, by_plan_mm: float) -> bool:
    """The bone surely is of another size than the model, and that costs more than is promised.

    Errors of a cartilage's thickness that go together look the same.
    """
    sigma_mm = math.hypot(estimate.size_sigma_mm, by_plan_mm)
    return abs(estimate.size_mm) > max(OK_ERROR_MM, _SURE_SIGMAS * sigma_mm)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
