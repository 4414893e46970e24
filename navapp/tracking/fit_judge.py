"""A fit becomes an answer: joined with the outline, judged, and told in the left camera."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.rig import RigQuality
from navapp.geometry.transform import RigidTransform
from navapp.registration import Candidate, RegistrationModel, find_candidates
from navapp.stereo import measure_health
from navapp.tracking.contours import ContourMeter
from navapp.tracking.correlated_residuals import noise_ratio2, with_correlated_residuals
from navapp.tracking.cross_checks import CrossCheck, CrossChecks
from navapp.tracking.follower import Fit, sum_timings
from navapp.tracking.judge import Goal, Judge, within_tolerance
from navapp.tracking.pair_doubts import row_check, with_pair_doubts
from navapp.tracking.surface_meter import CoarseMap, Measurement, SurfaceMeter
from navapp.values import LineTimings, PoseEstimate, Reason, Status, TrackedFrame, Verdict

# A model that moved by less looks the same.
_SAME_VIEW_MM = 0.05


class FitJudge:
    """Judges fits of one bone under one rig; holds only what is constant."""

    def __init__(
        self, meter: SurfaceMeter, model: RegistrationModel, quality: RigQuality | None
    ) -> None:
        """Join what is judged and what tells what hides it.

        Args:
            meter: measures surfaces.
            model: of the bone.
            quality: what the rig's calibration says of itself.
        """
        self._meter = meter
        self._model = model
        self._judge = Judge(meter.geometry, quality)
        self._contours = ContourMeter(model, meter.geometry)

    def judged(
        self,
        pair: RectifiedPair,
        fit: Fit | None,
        goal: Goal,
        timings: LineTimings,
        predicted: RigidTransform | None = None,
        checks: CrossChecks | None = None,
    ) -> TrackedFrame:
        """The answer that a fit gives, in the left camera before rectification.

        Args:
            pair: that it was fitted in.
            fit: of the bone; None out of view.
            goal: of the stage.
            timings: of what came before the fit.
            predicted: pose expected by the motion model, in the rectified camera.
            checks: of that pair, where more than the fit is known of it.
        """
        if fit is None:
            return self.lost(Reason.OUT_OF_VIEW, timings)
        started = time.perf_counter_ns()
        depth_mm = float(fit.pose.apply(self._model.centre_mm)[2])
        checks = checks or self.checking(pair)
        health, agreement, coarse_px = checks.of(fit.measured, fit.pose)
        if agreement is not None:
            noise2 = noise_ratio2(lies_open=agreement.lies_open)
            fit = self._contours.joined(pair, fit, coarse_px, noise2)
            fit = replace(fit, estimate=with_correlated_residuals(fit.estimate, noise2))
        # A model that the fit has moved no longer looks as it was matched.
        verdict = self._judge.judge(
            self._model, fit.estimate, fit.measured.disparity, goal, predicted, coarse_px,
            agreement if fit.moved_mm < _SAME_VIEW_MM else None,
        )  # fmt: skip
        verdict = with_pair_doubts(verdict, health, pair.geometry, depth_mm)
        verdict = within_tolerance(verdict, goal)
        rows = row_check(health, pair.geometry, depth_mm)
        judge_ms = (time.perf_counter_ns() - started) / 1e6
        timings = replace(sum_timings(timings, fit.timings), judge_ms=timings.judge_ms + judge_ms)
        estimate = None if verdict.predicted_tre_mm is None else self._unrectified(fit.estimate)
        return TrackedFrame(self._model.bone.name, estimate, verdict, timings, rows)

    def checking(
        self, pair: RectifiedPair, coarse: Callable[[], CoarseMap | None] = lambda: None
    ) -> CrossChecks:
        """Checks of what is measured in a pair.

        Args:
            pair: pictures.
            coarse: whatever lies around the bone, when a check asks for it; matched anew where it
                does not reach.
        """

        def check(measured: Measurement, pose: RigidTransform) -> CrossCheck:
            found, view = measured.disparity, measured.view
            depth_mm = float(pose.apply(self._model.centre_mm)[2])
            health = measure_health(pair, found, pair.geometry.disparity_px(depth_mm))
            coarse_px = self._coarse_px(pair, found.box, pose, coarse())
            if view is None:
                return CrossCheck(health, None, coarse_px)
            agreement = self._judge.agreement(self._model, pose, found, coarse_px, view)
            return CrossCheck(health, agreement, coarse_px)

        return CrossChecks(check)

    def lost(self, reason: Reason, timings: LineTimings | None = None) -> TrackedFrame:
        """The answer when there is no fit to judge."""
        verdict = Verdict(Status.LOST, None, (reason,))
        return TrackedFrame(self._model.bone.name, None, verdict, timings or LineTimings())

    def score(self, fit: Fit) -> float:
        """How much of the model a fit explains; 0 without a covariance."""
        is_fixed = np.isfinite(fit.estimate.covariance).all()
        return self.explained(fit.pose, fit.measured) if is_fixed else 0.0

    def explained(self, pose: RigidTransform, measured: Measurement) -> float:
        """How much of the model, at a pose in the rectified camera, a measurement explains."""
        found = self._judge.agreement(self._model, pose, measured.disparity)
        return found.coverage * found.inlier_share

    def is_there(self, fit: Fit) -> bool:
        """Whether so much of the model agrees with what it was fitted to that it may be there."""
        found = self._judge.agreement(self._model, fit.pose, fit.measured.disparity)
        return not self._judge.is_elsewhere(found)

    def led_to(
        self,
        measured: Measurement,
        starts: Sequence[RigidTransform],
        on_progress: Callable[[float], None] = lambda share: None,
    ) -> list[Candidate]:
        """Distinct poses that starts lead to on a measured surface, by what they explain of it."""
        return find_candidates(
            measured.scene,
            self._model,
            starts,
            lambda pose: self.explained(pose, measured),
            on_progress,
        )

    def _coarse_px(
        self, pair: RectifiedPair, box: Box, pose: RigidTransform, coarse: CoarseMap | None
    ) -> NDArray[np.float32] | None:
        """(h, w) of a coarse map over a box; matched where the map does not reach."""
        known_px = None if coarse is None else coarse.over(box)
        if known_px is not None:
            return known_px
        coarse = self._meter.coarsely(pair, pose, box)
        return None if coarse is None else coarse.disparity_px

    def _unrectified(self, estimate: PoseEstimate) -> PoseEstimate:
        """The same estimate in the left camera before rectification: a pure rotation."""
        left_from_rectified = self._meter.geometry.rectified_from_left.inverse()
        turn = np.kron(np.eye(2), left_from_rectified.rotation)
        return replace(
            estimate,
            camera_from_bone=left_from_rectified @ estimate.camera_from_bone,
            covariance=turn @ estimate.covariance @ turn.T,
        )
