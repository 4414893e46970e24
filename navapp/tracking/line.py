"""The line: one stereo frame in, one judged pose out.

`Line.track` is the frame's whole way in the paper's order. No step knows a device, a thread or the
terminal; what is remembered between frames is handed in and out as a `TrackState`.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import beside
from navapp.geometry.rectification import Box, Image, RectifiedPair
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import (
    RegistrationModel,
    distinct,
    estimate_at,
    find_candidates,
    tilted_starts,
)
from navapp.tracking.box_guide import BoxGuide
from navapp.tracking.contours import ContourMeter
from navapp.tracking.first_look import FirstLook, doubted, poses_to_refine
from navapp.tracking.follower import Fit, sum_timings
from navapp.tracking.judge import Goal, Judge
from navapp.tracking.locator import STEREO_SETTINGS, Locator, LocatorSettings
from navapp.tracking.motion import TrackState
from navapp.tracking.pair_doubts import with_pair_doubts
from navapp.tracking.recovery import starts_after_loss
from navapp.tracking.surface_meter import Margins, Measurement, RoughMap, SurfaceMeter
from navapp.values import (
    AspectGraph,
    BoneModel,
    LineTimings,
    PoseEstimate,
    Prior,
    Reason,
    Status,
    TrackedFrame,
    Verdict,
)

# A first registration tries near starts first, which is so much of the work of both lists.
_NEAR_SHARE = 0.1
# Rectified around an expected bone: a little more than is matched when it is there, for it may have
# moved; much more when it has to be searched.
_NEAR_VIEW = Margins(box_px=56, band_mm=60.0)
_WIDE_VIEW = Margins(box_px=120, band_mm=65.0)
# A model that moved by less looks the same.
_SAME_VIEW_MM = 0.05
# Tilts and shifts of a rough pose: (deg, how many).
_NEAR_TILTS = (15.0, 12)
_FAR_TILTS = ((15.0, 12), (28.0, 20))
_FAR_SHIFT_MM = 8.0
# Candidates of a search everywhere that explain less than this share of the best are left out.
_REFINED_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class LineSettings:
    """How the line works.

    Attributes:
        locator: how the bone is located around an expected pose.
        depth_mm: nearest and farthest surface that the rig is used for.
        max_points: about so many measured points enter an estimate.
        n_refined: so many of its answers are refined.
    """

    locator: LocatorSettings = field(default_factory=LocatorSettings)
    depth_mm: tuple[float, float] = (300.0, 700.0)
    max_points: int = 2500
    n_refined: int = 3


class Line:
    """The steps of one rig and one bone; holds only what is constant.

    Args:
        rig: of the pictures.
        bone: what is followed.
        settings: how.
        aspects: edges of the bone, for a first registration without a pose. Without them it goes by
            the measured surface alone, which finds the bone in a box, but less often in the whole
            view (docs/registration.md).
    """

    def __init__(
        self,
        rig: StereoRig,
        bone: BoneModel,
        settings: LineSettings | None = None,
        aspects: AspectGraph | None = None,
    ) -> None:
        self.settings = settings or LineSettings()
        self.rig = rig
        self.model = RegistrationModel(bone)
        self._meter = SurfaceMeter(
            rig, self.model, self.settings.depth_mm, self.settings.max_points
        )
        self._geometry = self._meter.geometry
        self._first_look = FirstLook(
            self._meter.rectifier, self.model, self.settings.depth_mm, aspects
        )
        self._boxes = BoxGuide(rig, self.model)
        is_accepted = rig.quality is None or rig.quality.is_accepted
        self._judge = Judge(self._geometry, is_accepted)
        self._contours = ContourMeter(self.model, self._geometry)
        self.locator = Locator(self._meter, self.model, self._score, self.settings.locator)

    @property
    def centre_mm(self) -> FloatArray:
        """(3,) mean of the model's vertices, in bone coordinates."""
        return self.model.centre_mm

    def track(
        self, left: Image, right: Image, captured_ns: int, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame (the paper's intra-operative loop)."""
        expected = state.predicted(captured_ns, self.centre_mm)
        predicted, boxes = self._rectified(expected), state.box
        tracked = self._lost(Reason.BONE_LOST)
        if self.locator.is_baseline:
            # The baseline has its box from the pictures, and its start from the box.
            boxes = self._boxes.followed(boxes, left, state.left_from_bone)
            expected = self._boxes.starts(expected, boxes)[0]
        if state.n_lost == 0:
            start = self._rectified(expected)
            pair, timings = self._rectified_pair(left, right, start, _NEAR_VIEW)
            # What may hide the bone does not depend on where exactly it is.
            rough = beside(lambda: self._meter.coarsely(pair, start))
            fit = self.locator.locate(pair, start)
            tracked = self._judged(pair, fit, goal, timings, predicted, rough.result())
        if tracked.verdict.status is Status.LOST:
            if not self.locator.is_baseline:
                boxes = self._boxes.followed(boxes, left)
            for place in self._boxes.starts(expected, boxes):
                pose = self._rectified(place)
                pair, timings = self._rectified_pair(left, right, pose)
                timings = sum_timings(tracked.timings, timings)
                fit = self._found_again(pair, pose, state.n_lost)
                tracked = self._judged(pair, fit, goal, timings, predicted)
                if tracked.verdict.status is not Status.LOST:
                    break
        boxes = self._boxes.placed(boxes, left, tracked)
        return tracked, replace(state.updated(tracked, captured_ns, self.centre_mm), box=boxes)

    def _found_again(self, pair: RectifiedPair, pose: RigidTransform, n_lost: int) -> Fit | None:
        """Around an expected pose; or in every other lost frame further off, from a few starts."""
        starts = starts_after_loss(pose, self.centre_mm, n_lost)
        measured = self._meter.freely(pair, pose, _WIDE_VIEW) if starts else None
        if measured is None or len(measured.cloud) == 0 or self.locator.is_baseline:
            return self.locator.search(pair, pose, self.settings.locator.search)
        started = time.perf_counter_ns()
        poses = self._coarse(measured, starts, lambda share: None)
        coarse = LineTimings(estimate_ms=(time.perf_counter_ns() - started) / 1e6)
        best = self.locator.settle(pair, measured, poses[0] if poses else pose)
        return replace(best, timings=sum_timings(best.timings, coarse))

    def register(
        self,
        left: Image,
        right: Image,
        prior: Prior,
        goal: Goal,
        on_progress: Callable[[float], None] = lambda share: None,
    ) -> list[TrackedFrame]:
        """Find the bone from a rough pose, a box or a cone: distinct candidates, best first.

        Args:
            left: picture of the left camera.
            right: of the right one, at the same instant.
            prior: a pose of this bone; or a box, a cone, or both, which are used without one.
            goal: for the judge.
            on_progress: told the share done; what it raises stops the search.
        """
        start = prior.left_from_bone.get(self.model.bone.name)
        if start is None:
            return self._register_anywhere(left, right, prior, goal, on_progress)
        rough = self._rectified(start)
        pair, timings = self._rectified_pair(left, right, rough)
        locator = self.locator
        measured = self._meter.freely(
            pair, rough, self.settings.locator.search, is_baseline=locator.is_baseline
        )
        if measured is None or len(measured.cloud) == 0:
            return [self._lost(Reason.NO_SURFACE)]
        if locator.is_baseline:
            # The paper's baseline has its start and nothing else.
            return [self._judged(pair, locator.settle(pair, measured, rough), goal, timings)]

        def looked_from(starts: list[RigidTransform], done: float, share: float) -> list[Fit]:
            poses = self._coarse(measured, starts, lambda part: on_progress(done + share * part))
            return [locator.settle(pair, measured, pose) for pose in poses]

        centre_mm = rough.apply(self.centre_mm)
        fits = looked_from(near_starts(rough, centre_mm), 0.0, _NEAR_SHARE)
        answers = self._ranked(pair, fits, goal, timings)
        if not answers or answers[0].verdict.status is not Status.OK:
            fits += looked_from(far_starts(rough, centre_mm), _NEAR_SHARE, 1.0 - _NEAR_SHARE)
            answers = self._ranked(pair, fits, goal, timings)
        on_progress(1.0)
        return answers

    def _ranked(
        self, pair: RectifiedPair, fits: list[Fit], goal: Goal, timings: LineTimings
    ) -> list[TrackedFrame]:
        """Distinct answers, best first; a guess is called one."""
        fits = doubted(fits, [self._score(fit) for fit in fits], self.model)
        kept = distinct([fit.pose for fit in fits], self.centre_mm)
        return [self._judged(pair, fit, goal, timings) for fit in fits if fit.pose in kept]

    def _register_anywhere(
        self,
        left: Image,
        right: Image,
        prior: Prior,
        goal: Goal,
        on_progress: Callable[[float], None],
    ) -> list[TrackedFrame]:
        """As `register`, without a pose to start from; the paper's baseline cannot."""
        if not prior.starts(self.model.bone.name) or self.locator.is_baseline:
            return []
        started = time.perf_counter_ns()
        pair, candidates = self._first_look.candidates(left, right, prior, on_progress)
        timings = LineTimings(estimate_ms=(time.perf_counter_ns() - started) / 1e6)
        poses = poses_to_refine(candidates, self.settings.n_refined, _REFINED_SHARE)
        found = [self._from_candidate(pair, pose) for pose in poses]
        fits = [fit for fit in found if fit is not None]
        if not fits:
            return [self._lost(Reason.NO_SURFACE, timings)]
        return self._ranked(pair, fits, goal, timings)

    def _from_candidate(self, pair: RectifiedPair, pose: RigidTransform) -> Fit | None:
        """What explains more: the model matched where it is expected, or what lies around it.

        Clutter around a bone can pull it away from where the first finds it.
        """
        locator = self.locator
        fits = (locator.locate(pair, pose), locator.search(pair, pose, locator.settings.search))
        return max((fit for fit in fits if fit is not None), key=self._score, default=None)

    def assess(
        self, left: Image, right: Image, left_from_bone: RigidTransform, goal: Goal
    ) -> TrackedFrame:
        """Judge a pose as it stands, without moving it, by the surface that is seen there."""
        pose = self._rectified(left_from_bone)
        pair, timings = self._rectified_pair(left, right, pose, _NEAR_VIEW)
        measured = self._meter.freely(pair, pose, self.settings.locator.tracking)
        if measured is None:
            return self._lost(Reason.OUT_OF_VIEW)
        estimate = estimate_at(measured.scene, self.model, pose, STEREO_SETTINGS)
        return self._judged(pair, Fit(estimate, measured, measured.timings), goal, timings)

    def _coarse(
        self,
        measured: Measurement,
        starts: list[RigidTransform],
        on_progress: Callable[[float], None],
    ) -> list[RigidTransform]:
        """The best distinct poses that starts lead to."""
        found = find_candidates(
            measured.scene,
            self.model,
            starts,
            lambda pose: self._explained(pose, measured),
            on_progress,
        )
        return [candidate.scene_from_bone for candidate in found[: self.settings.n_refined]]

    def _score(self, fit: Fit) -> float:
        """How much of the model a fit explains; 0 without a covariance."""
        is_fixed = np.isfinite(fit.estimate.covariance).all()
        return self._explained(fit.pose, fit.measured) if is_fixed else 0.0

    def _explained(self, pose: RigidTransform, measured: Measurement) -> float:
        found = self._judge.agreement(self.model, pose, measured.disparity)
        return found.coverage * found.inlier_share

    def _judged(
        self,
        pair: RectifiedPair,
        fit: Fit | None,
        goal: Goal,
        timings: LineTimings,
        predicted: RigidTransform | None = None,
        rough: RoughMap | None = None,
    ) -> TrackedFrame:
        """Judge, and hand the pose out in the unrectified left camera."""
        if fit is None:
            return self._lost(Reason.OUT_OF_VIEW, timings)
        started = time.perf_counter_ns()
        found = fit.measured.disparity
        coarse_px = self._rough_px(pair, fit, rough)
        fit = self._contours.joined(pair, fit, coarse_px)
        view = fit.measured.view if fit.moved_mm < _SAME_VIEW_MM else None
        verdict = self._judge.judge(
            self.model, fit.estimate, found, goal, predicted, coarse_px, view
        )
        verdict = with_pair_doubts(verdict, pair, found, fit.pose.apply(self.centre_mm)[2])
        judge_ms = (time.perf_counter_ns() - started) / 1e6
        timings = replace(sum_timings(timings, fit.timings), judge_ms=timings.judge_ms + judge_ms)
        name = self.model.bone.name
        if verdict.predicted_tre_mm is None:
            return TrackedFrame(name, None, verdict, timings)
        return TrackedFrame(name, self._unrectified(fit.estimate), verdict, timings)

    def _rough_px(
        self, pair: RectifiedPair, fit: Fit, rough: RoughMap | None
    ) -> NDArray[np.float32] | None:
        """Rough disparity over the box of a fit; matched anew when there is none of all of it."""
        found = fit.measured.disparity
        height, width = found.disparity_px.shape
        box = Box(found.x, found.y, width, height)
        known_px = None if rough is None else rough.over(box)
        if known_px is not None:
            return known_px
        rough = self._meter.coarsely(pair, fit.pose, box)
        return None if rough is None else rough.disparity_px

    def _lost(self, reason: Reason, timings: LineTimings | None = None) -> TrackedFrame:
        verdict = Verdict(Status.LOST, None, (reason,))
        return TrackedFrame(self.model.bone.name, None, verdict, timings or LineTimings())

    def _rectified_pair(
        self, left: Image, right: Image, around: RigidTransform, margins: Margins = _WIDE_VIEW
    ) -> tuple[RectifiedPair, LineTimings]:
        return self._meter.rectified(left, right, around, margins)

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


def near_starts(rough: RigidTransform, centre_mm: FloatArray) -> list[RigidTransform]:
    """A rough pose, and tilts of it about a place in the camera's frame."""
    return tilted_starts(rough, centre_mm, *_NEAR_TILTS)


def far_starts(rough: RigidTransform, centre_mm: FloatArray) -> list[RigidTransform]:
    """Tilts of a rough pose and of what it becomes when shifted along each axis."""
    starts = []
    for shift in (np.zeros(3), *(_FAR_SHIFT_MM * np.eye(3)), *(-_FAR_SHIFT_MM * np.eye(3))):
        moved = rough.moved(np.concatenate([shift, np.zeros(3)]), centre_mm)
        starts.append(moved)
        for tilt_deg, n_tilts in _FAR_TILTS:
            starts += tilted_starts(moved, centre_mm + shift, tilt_deg, n_tilts)[1:]
    return starts
