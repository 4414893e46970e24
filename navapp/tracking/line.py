"""The line: one stereo frame in, one judged pose out.

`Line.track` is the frame's whole way in the paper's order. No step knows a device, a thread or the
terminal; what is remembered between frames is handed in and out as a `TrackState`.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import (
    PointToPlaneSettings,
    RegistrationModel,
    distinct,
    estimate_at,
    find_candidates,
    fit_icp,
    fit_point_to_plane,
    tilted_starts,
)
from navapp.tracking.judge import Goal, Judge
from navapp.tracking.motion import TrackState
from navapp.tracking.surface_meter import Margins, Measurement, SurfaceMeter
from navapp.values import (
    BoneModel,
    LineTimings,
    PoseEstimate,
    Prior,
    Reason,
    Status,
    TrackedFrame,
    Verdict,
)

Image = NDArray[np.uint8]
Method = Literal["bimcc", "icp"]


@dataclass(frozen=True, slots=True)
class LineSettings:
    """How the line works.

    Attributes:
        method: `icp` is the paper's baseline chain; anything else the production one.
        depth_mm: nearest and farthest surface that the rig is used for.
        tracking: margins from frame to frame.
        search: margins of a first registration, and after a loss.
        max_points: about so many measured points enter an estimate.
        tilt_deg: of the starts of a first registration.
        n_refined: so many of its answers are refined.
        max_rounds: matching on the model and fitting are repeated at most so often ...
        settled_mm: ... until the bone's centre moves by less.
    """

    method: Method = "bimcc"
    depth_mm: tuple[float, float] = (300.0, 700.0)
    tracking: Margins = field(default_factory=lambda: Margins(box_px=16, band_mm=15.0))
    search: Margins = field(default_factory=lambda: Margins(box_px=60, band_mm=35.0))
    max_points: int = 2500
    tilt_deg: float = 15.0
    n_refined: int = 3
    max_rounds: int = 4
    settled_mm: float = 0.03


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """A pose in the rectified camera, what it was fitted to, and how long both took."""

    estimate: PoseEstimate
    measured: Measurement
    timings: LineTimings


class Line:
    """The steps of one rig and one bone; holds only what is constant."""

    def __init__(
        self, rig: StereoRig, bone: BoneModel, settings: LineSettings | None = None
    ) -> None:
        self.settings = settings or LineSettings()
        self.rig = rig
        self.model = RegistrationModel(bone)
        self._meter = SurfaceMeter(
            rig, self.model, self.settings.depth_mm, self.settings.max_points
        )
        self._geometry = self._meter.geometry
        is_accepted = rig.quality is None or rig.quality.is_accepted
        self._judge = Judge(self._geometry, is_accepted)
        self._wide = PointToPlaneSettings()
        self._near = PointToPlaneSettings(radii_mm=self._wide.radii_mm[1:])
        # On the model's own surface errors go together over a window, not over a staircase.
        self._fine = replace(self._near, correlation_px=11.0)

    @property
    def centre_mm(self) -> FloatArray:
        """(3,) mean of the model's vertices, in bone coordinates."""
        return self.model.centre_mm

    def track(
        self, left: Image, right: Image, captured_ns: int, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame (the paper's intra-operative loop)."""
        predicted = self._rectified(state.predicted(captured_ns, self.centre_mm))
        pair, timings = self._meter.rectified(left, right)
        fit = self._follow(pair, predicted) if state.n_lost == 0 else None
        tracked = self._judged(fit, goal, timings, predicted)
        if tracked.verdict.status is Status.LOST:
            # The prediction was too far off for the model's own surface: look around it first.
            fit = self._search(pair, predicted)
            tracked = self._judged(fit, goal, _sum(timings, tracked.timings), predicted)
        return tracked, state.updated(tracked, captured_ns, self.centre_mm)

    def register(
        self,
        left: Image,
        right: Image,
        prior: Prior,
        goal: Goal,
        on_progress: Callable[[float], None] = lambda share: None,
    ) -> list[TrackedFrame]:
        """Find the bone from a rough pose: distinct candidates, best first.

        Args:
            left: picture of the left camera.
            right: of the right one, at the same instant.
            prior: must hold a pose of this bone.
            goal: for the judge.
            on_progress: told the share done; what it raises stops the search.
        """
        start = prior.left_from_bone.get(self.model.bone.name)
        if start is None:
            return []
        rough = self._rectified(start)
        pair, timings = self._meter.rectified(left, right)
        measured = self._meter.freely(pair, rough, self.settings.search)
        if measured is None or len(measured.cloud) == 0:
            return [self._lost(Reason.NO_SURFACE)]
        starts = tilted_starts(rough, self.centre_mm, self.settings.tilt_deg)
        if self.settings.method == "icp":
            starts = [rough]
        coarse = find_candidates(
            measured.cloud,
            self.model,
            starts,
            lambda estimate: self._score(estimate, measured),
            on_progress,
        )
        fits = [
            self._settled(pair, self._fitted(measured, estimate.camera_from_bone, self._wide))
            for estimate in coarse[: self.settings.n_refined]
        ]
        fits.sort(key=lambda fit: self._score(fit.estimate, fit.measured), reverse=True)
        kept = distinct([fit.estimate for fit in fits], self.centre_mm)
        return [self._judged(fit, goal, timings) for fit in fits if fit.estimate in kept]

    def assess(
        self, left: Image, right: Image, left_from_bone: RigidTransform, goal: Goal
    ) -> TrackedFrame:
        """Judge a pose as it stands, without moving it, by the surface that is seen there."""
        pose = self._rectified(left_from_bone)
        pair, timings = self._meter.rectified(left, right)
        measured = self._meter.freely(pair, pose, self.settings.tracking)
        if measured is None:
            return self._lost(Reason.OUT_OF_VIEW)
        estimate = estimate_at(measured.cloud, self.model, pose, settings=self._near)
        return self._judged(_Fit(estimate, measured, measured.timings), goal, timings)

    def _follow(self, pair: RectifiedPair, pose: RigidTransform) -> _Fit | None:
        """Match on the model and fit, until it settles; None out of view."""
        if self.settings.method == "icp":
            return self._search(pair, pose)
        fit: _Fit | None = None
        timings = LineTimings()
        for _ in range(self.settings.max_rounds):
            measured = self._meter.on_model(pair, pose, self.settings.tracking)
            if measured is None:
                return None
            fit = self._fitted(measured, pose, self._fine)
            timings = _sum(timings, fit.timings)
            moved = fit.estimate.camera_from_bone.apply(self.centre_mm) - pose.apply(self.centre_mm)
            pose = fit.estimate.camera_from_bone
            if np.linalg.norm(moved) < self.settings.settled_mm:
                break
        return None if fit is None else replace(fit, timings=timings)

    def _search(self, pair: RectifiedPair, pose: RigidTransform) -> _Fit | None:
        """Match freely around a pose and fit from far, then settle; None out of view."""
        is_baseline = self.settings.method == "icp"
        margins = self.settings.tracking if is_baseline else self.settings.search
        measured = self._meter.freely(pair, pose, margins, fills=not is_baseline)
        if measured is None:
            return None
        return self._settled(pair, self._fitted(measured, pose, self._wide))

    def _settled(self, pair: RectifiedPair, fit: _Fit) -> _Fit:
        """A free fit, followed onto the model's own surface when it is found there."""
        if self.settings.method == "icp":
            return fit
        finer = self._follow(pair, fit.estimate.camera_from_bone)
        if finer is None or Reason.TOO_FEW_POINTS in finer.estimate.reasons:
            return fit
        return replace(finer, timings=_sum(fit.timings, finer.timings))

    def _fitted(
        self, measured: Measurement, start: RigidTransform, settings: PointToPlaneSettings
    ) -> _Fit:
        started = time.perf_counter_ns()
        if self.settings.method == "icp":
            estimate = fit_icp(measured.cloud, self.model, start)
        else:
            estimate = fit_point_to_plane(measured.cloud, self.model, start, settings)
        estimate_ms = (time.perf_counter_ns() - started) / 1e6
        return _Fit(estimate, measured, replace(measured.timings, estimate_ms=estimate_ms))

    def _score(self, estimate: PoseEstimate, measured: Measurement) -> float:
        """How much of the model a measurement explains; 0 without a covariance."""
        if not np.isfinite(estimate.covariance).all():
            return 0.0
        found = self._judge.agreement(self.model, estimate.camera_from_bone, measured.disparity)
        return found.coverage * found.inlier_share

    def _judged(
        self,
        fit: _Fit | None,
        goal: Goal,
        timings: LineTimings,
        predicted: RigidTransform | None = None,
    ) -> TrackedFrame:
        """Judge, and hand the pose out in the unrectified left camera."""
        if fit is None:
            return self._lost(Reason.OUT_OF_VIEW, timings)
        started = time.perf_counter_ns()
        verdict = self._judge.judge(
            self.model, fit.estimate, fit.measured.disparity, goal, predicted
        )
        judge_ms = (time.perf_counter_ns() - started) / 1e6
        timings = replace(_sum(timings, fit.timings), judge_ms=timings.judge_ms + judge_ms)
        name = self.model.bone.name
        if verdict.predicted_tre_mm is None:
            return TrackedFrame(name, None, verdict, timings)
        return TrackedFrame(name, self._unrectified(fit.estimate), verdict, timings)

    def _lost(self, reason: Reason, timings: LineTimings | None = None) -> TrackedFrame:
        verdict = Verdict(Status.LOST, None, (reason,))
        return TrackedFrame(self.model.bone.name, None, verdict, timings or LineTimings())

    def _rectified(self, left_from_bone: RigidTransform) -> RigidTransform:
        return self._geometry.rectified_from_left @ left_from_bone

    def _unrectified(self, estimate: PoseEstimate) -> PoseEstimate:
        """The same estimate in the left camera before rectification: a pure rotation."""
        left_from_rectified = self._geometry.rectified_from_left.inverse()
        turn = np.kron(np.eye(2), left_from_rectified.rotation)
        return replace(
            estimate,
            camera_from_bone=left_from_rectified @ estimate.camera_from_bone,
            covariance=turn @ estimate.covariance @ turn.T,
        )


def _sum(a: LineTimings, b: LineTimings) -> LineTimings:
    """Both, part by part."""
    parts = {part.name: getattr(a, part.name) + getattr(b, part.name) for part in fields(a)}
    return LineTimings(**parts)
