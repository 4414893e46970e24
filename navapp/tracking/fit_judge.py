"""A fit becomes an answer: joined with the outline, judged, and told in the left camera."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.rig import RigQuality
from navapp.geometry.transform import RigidTransform
from navapp.registration import Candidate, RegistrationModel, find_candidates
from navapp.stereo import measure_health
from navapp.tracking.contours import ContourMeter
from navapp.tracking.correlated_residuals import with_correlated_residuals
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
        coarse: CoarseMap | None = None,
        checks: CrossChecks | None = None,
    ) -> TrackedFrame:
        """The answer that a fit gives, in the left camera before rectification.

        Args:
            pair: that it was fitted in.
            fit: of the bone; None out of view.
            goal: of the stage.
            timings: of what came before the fit.
            predicted: pose expected by the motion model, in the rectified camera.
            coarse: whatever lies around the bone; matched anew where it does not reach.
            checks: of that pair, if any were begun.
        """
        if fit is None:
            return self.lost(Reason.OUT_OF_VIEW, timings)
        started = time.perf_counter_ns()
        found, geometry = fit.measured.disparity, pair.geometry
        depth_mm = float(fit.pose.apply(self._model.centre_mm)[2])
        coarse = self._reaching(pair, fit.measured, fit.pose, coarse)
        coarse_px = None if coarse is None else coarse.over(found.box)
        with checks or self.checking(pair, lambda: coarse) as checks:
            check = checks.begin(fit.measured, fit.pose)
            fit = self._contours.joined(pair, fit, coarse_px)
            health, agreement = check.result()
        if agreement is not None:
            shown = with_correlated_residuals(fit.estimate, lies_open=agreement.lies_open)
            fit = replace(fit, estimate=shown)
        # Where the fit has moved the model, it no longer looks as it was matched.
        agreement = agreement if fit.moved_mm < _SAME_VIEW_MM else None
        verdict = self._judge.judge(
            self._model, fit.estimate, found, goal, predicted, coarse_px, agreement
        )
        verdict = with_pair_doubts(verdict, health, geometry, depth_mm)
        verdict = within_tolerance(verdict, goal)
        rows = row_check(health, geometry, depth_mm)
        judge_ms = (time.perf_counter_ns() - started) / 1e6
        timings = replace(sum_timings(timings, fit.timings), judge_ms=timings.judge_ms + judge_ms)
        estimate = None if verdict.predicted_tre_mm is None else self._unrectified(fit.estimate)
        return TrackedFrame(self._model.bone.name, estimate, verdict, timings, rows)

    def checking(self, pair: RectifiedPair, coarse: Callable[[], CoarseMap | None]) -> CrossChecks:
        """Checks of what is measured in a pair.

        Args:
            pair: pictures.
            coarse: whatever lies around the bone; asked for when a check needs it.
        """

        def check(measured: Measurement, pose: RigidTransform) -> CrossCheck:
            depth_mm = float(pose.apply(self._model.centre_mm)[2])
            health = measure_health(pair, measured.disparity, pair.geometry.disparity_px(depth_mm))
            if measured.view is None:
                return CrossCheck(health, None)
            around = self._reaching(pair, measured, pose, coarse())
            found = measured.disparity
            coarse_px = None if around is None else around.over(found.box)
            return CrossCheck(
                health,
                self._judge.agreement(self._model, pose, found, coarse_px, measured.view),
            )

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

    def coarse_px(self, pair: RectifiedPair, fit: Fit) -> NDArray[np.float32] | None:
        """(h, w) coarse disparity over the box of a fit; None out of view or depth."""
        coarse = self._reaching(pair, fit.measured, fit.pose, None)
        return None if coarse is None else coarse.disparity_px

    def _reaching(
        self,
        pair: RectifiedPair,
        measured: Measurement,
        pose: RigidTransform,
        coarse: CoarseMap | None,
    ) -> CoarseMap | None:
        """A coarse map that reaches over all of a measurement's box; matched if need be."""
        box = measured.disparity.box
        if coarse is not None and coarse.over(box) is not None:
            return coarse
        return self._meter.coarsely(pair, pose, box)

    def _unrectified(self, estimate: PoseEstimate) -> PoseEstimate:
        """The same estimate in the left camera before rectification: a pure rotation."""
        left_from_rectified = self._meter.geometry.rectified_from_left.inverse()
        turn = np.kron(np.eye(2), left_from_rectified.rotation)
        return replace(
            estimate,
            camera_from_bone=left_from_rectified @ estimate.camera_from_bone,
            covariance=turn @ estimate.covariance @ turn.T,
        )
