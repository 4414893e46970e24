"""The judge: is this pose good enough to be shown?

A wrong pose is worse than none. The judge therefore looks at what did not enter the fit: how much
of the model that should be seen was measured and agrees, not only how well paired points agree.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Box, RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import RenderedView, render_rectified
from navapp.registration.model import RegistrationModel
from navapp.values import (
    DisparityMap,
    Origin,
    PoseEstimate,
    Reason,
    Status,
    Verdict,
    predicted_tre_mm,
    visible_vertices,
)

# A connected region that is measured nearer than the model by this is an instrument or a hand.
_OCCLUDER_MM = 2.0
_OCCLUDER_PX = 25


@dataclass(frozen=True, slots=True)
class JudgeLimits:
    """Bounds of the judge.

    Attributes:
        coverage_ok, coverage_lost: share of the visible model that is measured and agrees.
        inlier_ok, inlier_lost: share of the measured model pixels that agree.
        rms_ratio_ok, rms_ratio_lost: rms of the residual over what its sigma predicts.
        jump_mm: largest motion of the bone's centre from the prediction.
        fit_sigmas: a pixel agrees when it differs by less than this many sigma.
        max_bound_targets: targets used for the predicted error.
    """

    coverage_ok: float = 0.4
    coverage_lost: float = 0.25
    inlier_ok: float = 0.8
    inlier_lost: float = 0.5
    rms_ratio_ok: float = 1.25
    rms_ratio_lost: float = 2.0
    jump_mm: float = 12.0
    fit_sigmas: float = 3.0
    max_bound_targets: int = 200


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """What the judge measures a pose against: the stage's targets and tolerance."""

    targets_mm: FloatArray
    tolerance_mm: float


@dataclass(frozen=True, slots=True)
class Agreement:
    """Two-way comparison of the rendered model and the measured disparity."""

    n_visible: int
    coverage: float
    occluded_share: float
    inlier_share: float


class Judge:
    """Judges poses of one bone under one rig."""

    def __init__(
        self, geometry: RectifiedGeometry, is_rig_accepted: bool, limits: JudgeLimits | None = None
    ) -> None:
        self._geometry = geometry
        self._is_rig_accepted = is_rig_accepted
        self._limits = limits or JudgeLimits()

    def agreement(
        self, model: RegistrationModel, rectified_from_bone: RigidTransform, measured: DisparityMap
    ) -> Agreement:
        """How much of the model that should be seen was measured, and agrees."""
        view = self._render(model, rectified_from_bone, measured)
        return self._compare(view, model, measured)

    def judge(
        self,
        model: RegistrationModel,
        estimate: PoseEstimate,
        measured: DisparityMap,
        goal: Goal,
        predicted: RigidTransform | None = None,
    ) -> Verdict:
        """Status, reasons and predicted error of a pose.

        Args:
            model: prepared bone.
            estimate: in the rectified left camera.
            measured: disparity over the bone's box.
            goal: of the stage.
            predicted: pose expected by the motion model, for the jump test.
        """
        if not np.isfinite(estimate.covariance).all():
            return Verdict(Status.LOST, None, estimate.reasons or (Reason.DEGENERATE,))
        agreement = self.agreement(model, estimate.camera_from_bone, measured)
        if agreement.n_visible == 0:
            return Verdict(Status.LOST, None, (Reason.OUT_OF_VIEW,))
        bound_mm = self._bound_mm(model, estimate, goal.targets_mm)
        doubts = self._doubts(estimate, agreement)
        doubts += [Reason.TRE_TOO_LARGE] * (bound_mm > goal.tolerance_mm)
        doubts += [Reason.JUMPED] * self._has_jumped(model, estimate, predicted)
        is_lost = self._is_lost(estimate, agreement)
        return Verdict(
            Status.LOST if is_lost else (Status.DEGRADED if doubts else Status.OK),
            bound_mm,
            tuple(doubts),
            agreement.coverage,
            agreement.occluded_share,
            agreement.inlier_share,
            estimate.rms_mm,
            estimate.expected_rms_mm,
        )

    def _doubts(self, estimate: PoseEstimate, agreement: Agreement) -> list[Reason]:
        """What keeps a pose from being OK, apart from the stage's own limits."""
        limits = self._limits
        ratio = estimate.rms_mm / estimate.expected_rms_mm
        doubts = list(estimate.reasons)
        doubts += [Reason.COVERAGE_LOW] * (agreement.coverage < limits.coverage_ok)
        doubts += [Reason.OUTLIERS] * (agreement.inlier_share < limits.inlier_ok)
        doubts += [Reason.SURFACE_MISFIT] * (ratio > limits.rms_ratio_ok)
        doubts += [Reason.RIG_NOT_ACCEPTED] * (not self._is_rig_accepted)
        return doubts

    def _is_lost(self, estimate: PoseEstimate, agreement: Agreement) -> bool:
        limits = self._limits
        return (
            agreement.coverage < limits.coverage_lost
            or agreement.inlier_share < limits.inlier_lost
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
        moved = estimate.camera_from_bone.apply(model.centre_mm) - predicted.apply(model.centre_mm)
        return bool(np.linalg.norm(moved) > self._limits.jump_mm)

    def _render(
        self, model: RegistrationModel, pose: RigidTransform, measured: DisparityMap
    ) -> RenderedView:
        height, width = measured.disparity_px.shape
        return render_rectified(
            model.seen_mesh, pose, self._geometry, Box(measured.x, measured.y, width, height)
        )

    def _compare(
        self, view: RenderedView, model: RegistrationModel, measured: DisparityMap
    ) -> Agreement:
        seen = view.mask
        n_visible = int(seen.sum())
        if n_visible == 0:
            return Agreement(0, 0.0, 0.0, 0.0)
        scale = self._geometry.focal_px * self._geometry.baseline_mm
        is_measured = seen & (measured.origin == Origin.MATCHED)
        expected_px = np.where(seen, scale / view.depth_mm, np.nan)
        difference_px = np.where(is_measured, measured.disparity_px - expected_px, np.nan)
        surface_px = float(model.sigma_mm.mean()) * expected_px**2 / scale
        sigma_px = np.hypot(measured.sigma_px, surface_px)
        agrees = np.abs(difference_px) < self._limits.fit_sigmas * sigma_px
        nearer_px = np.maximum(4.0 * sigma_px, _OCCLUDER_MM * expected_px**2 / scale)
        is_hidden = _large_regions(difference_px > nearer_px)
        n_open = int((is_measured & ~is_hidden).sum())
        n_agreeing = int(agrees.sum())
        return Agreement(
            n_visible,
            n_agreeing / n_visible,
            float(is_hidden.sum()) / n_visible,
            n_agreeing / n_open if n_open else 0.0,
        )

    def _bound_mm(
        self, model: RegistrationModel, estimate: PoseEstimate, targets_mm: FloatArray
    ) -> float:
        if len(targets_mm) == 0:
            targets_mm = model.bone.mesh.vertices_mm[
                visible_vertices(model.bone.mesh, estimate.camera_from_bone)
            ]
        step = max(1, len(targets_mm) // self._limits.max_bound_targets)
        if len(targets_mm) == 0:
            return float("inf")
        return predicted_tre_mm(estimate, model.centre_mm, targets_mm[::step])


def _large_regions(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The mask without its connected specks."""
    import cv2

    _, labels, statistics, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    is_large = statistics[:, cv2.CC_STAT_AREA] >= _OCCLUDER_PX
    is_large[0] = False
    large: NDArray[np.bool_] = is_large[labels]
    return large
