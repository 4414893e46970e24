"""The line: one stereo frame in, one judged pose out.

`Line.track` is the frame's whole way in the paper's order. No step knows a device, a thread or the
terminal; what is remembered between frames is handed in and out as a `TrackState`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from navapp.geometry.bands import beside
from navapp.geometry.rectification import Image, RectifiedPair
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import RegistrationModel, estimate_at
from navapp.tracking.box_guide import BoxGuide
from navapp.tracking.buried import BuriedBone
from navapp.tracking.causes import Causes
from navapp.tracking.first_look import FirstLook
from navapp.tracking.fit_judge import FitJudge
from navapp.tracking.follower import Fit, sum_timings
from navapp.tracking.judge import Goal
from navapp.tracking.locator import NEAR_VIEW, STEREO_SETTINGS, WIDE_VIEW, Locator, LocatorSettings
from navapp.tracking.motion import TrackState, is_place_doubted, is_worth_a_search
from navapp.tracking.recovery import Recovery
from navapp.tracking.registrar import Registrar
from navapp.tracking.surface_meter import Margins, SurfaceMeter
from navapp.values import (
    AspectGraph,
    BoneModel,
    LineTimings,
    Prior,
    Reason,
    Status,
    TrackedFrame,
)

# It is asked so often, counted in lost frames, whether the pictures are swapped.
_LOST_BETWEEN = 10


@dataclass(frozen=True, slots=True)
class LineSettings:
    """How the line works.

    Attributes:
        locator: how the bone is located around an expected pose.
        depth_mm: nearest and farthest surface that the rig is used for.
        max_points: about so many measured points enter an estimate.
        n_refined: so many answers of a first registration's searches are refined.
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
        depth_mm, n_refined = self.settings.depth_mm, self.settings.n_refined
        meter = SurfaceMeter(rig, self.model, depth_mm, self.settings.max_points)
        judge = FitJudge(meter, self.model, rig.quality)
        self.locator = Locator(meter, self.model, judge.score, self.settings.locator)
        first_look = FirstLook(meter.rectifier, self.model, depth_mm, aspects)
        self._meter, self._fit_judge, self._boxes = meter, judge, BoxGuide(rig, self.model)
        self._recovery = Recovery(meter, self.model, self.locator, judge)
        self._buried = BuriedBone(meter, self.model, self.settings.locator)
        self._causes = Causes(meter, self.model, judge)
        self._registrar = Registrar(
            meter,
            self.model,
            self.locator,
            judge,
            first_look,
            self._buried,
            self._causes,
            n_refined,
        )

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
        tracked = self._fit_judge.lost(Reason.BONE_LOST)
        if self.locator.is_baseline:
            # The baseline has its box from the pictures, and its start from the box.
            boxes = self._boxes.followed(boxes, left, state.left_from_bone)
            expected = self._boxes.starts(expected, boxes)[0]
        if state.n_lost == 0:
            start = self._rectified(expected)
            pair, timings = self._rectified_pair(left, right, start, NEAR_VIEW)
            tracked = self._near(pair, start, predicted, goal, timings, state.is_search_due)
        if tracked.verdict.status is Status.LOST:
            if not self.locator.is_baseline:
                boxes = self._boxes.followed(boxes, left)
            places = self._boxes.starts(expected, boxes)
            tracked = self._searched(left, right, places, predicted, state.n_lost, tracked, goal)
        tracked = tracked.because(self._cause(left, right, predicted, state, tracked))
        after = state.updated(tracked, captured_ns, self.centre_mm)
        # What is not followed does not place the box either.
        boxes = self._boxes.placed(boxes, left, tracked) if after.n_lost == 0 else boxes
        return tracked, replace(after, box=boxes)

    def glance(
        self, left: Image, right: Image, captured_ns: int, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame, lost or not, if it is near where it is expected.

        Only the model itself is matched: that is soon done, and sees no more than some millimetres.
        """
        expected = self._rectified(state.predicted(captured_ns, self.centre_mm))
        pair, timings = self._rectified_pair(left, right, expected, NEAR_VIEW)
        coarse = self._meter.coarsely(pair, expected)
        checks = self._fit_judge.checking(pair, lambda: coarse)
        answers = [self._fit_judge.lost(Reason.BONE_LOST, timings)]
        for fit in self.locator.rests(pair, expected):
            timings = answers[-1].timings
            answers.append(self._fit_judge.judged(pair, fit, goal, timings, expected, checks))
            if not is_place_doubted(answers[-1].verdict):
                break
        best = min(reversed(answers), key=lambda one: one.verdict.order)
        tracked = replace(best, timings=answers[-1].timings).because(state.cause)
        after = state.updated(tracked, captured_ns, self.centre_mm)
        box = self._boxes.placed(state.box, left, tracked) if after.n_lost == 0 else state.box
        # A doubt that nothing was searched for puts off no search.
        return tracked, replace(after, box=box, n_doubted=0)

    def _near(
        self,
        pair: RectifiedPair,
        start: RigidTransform,
        predicted: RigidTransform,
        goal: Goal,
        timings: LineTimings,
        searches: bool,
    ) -> TrackedFrame:
        """The answer near an expected pose; when its place is in doubt, that of a buried bone."""
        # What may hide the bone does not depend on where exactly it is.
        with (
            beside(lambda: self._meter.coarsely(pair, start)) as job,
            self._fit_judge.checking(pair, job.result) as checks,
        ):
            fit = self.locator.locate(pair, start, checks.begin)
            first = self._fit_judge.judged(pair, fit, goal, timings, predicted, checks)
        if self.locator.is_baseline or not is_place_doubted(first.verdict):
            return first
        answers = [first]
        searches = searches and is_worth_a_search(first)
        for buried in self._buried.followed(pair, start, searches=searches):
            timings = answers[-1].timings
            answers.append(self._fit_judge.judged(pair, buried, goal, timings, predicted, checks))
            if answers[-1].verdict.status is Status.OK:
                break
        return replace(min(answers, key=lambda one: one.verdict.order), timings=answers[-1].timings)

    def _searched(
        self,
        left: Image,
        right: Image,
        places: list[RigidTransform],
        predicted: RigidTransform,
        n_lost: int,
        lost: TrackedFrame,
        goal: Goal,
    ) -> TrackedFrame:
        """The best answer of a search around poses, far around the first of them; the first OK."""
        answers, timings = [lost], lost.timings
        for number, place in enumerate(places):
            pose = self._rectified(place)
            pair, rectified = self._rectified_pair(left, right, pose)
            fit = self._recovery.found_again(pair, pose, 0 if number else n_lost)
            timings = sum_timings(timings, rectified)
            answers.append(self._fit_judge.judged(pair, fit, goal, timings, predicted))
            timings = answers[-1].timings
            if answers[-1].verdict.status is Status.OK:
                break
        # Of equals, what came later knows more.
        best = min(reversed(answers), key=lambda one: one.verdict.order)
        return replace(best, timings=timings)

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
        return self._registrar.register(left, right, prior, goal, on_progress)

    def assess(
        self, left: Image, right: Image, left_from_bone: RigidTransform, goal: Goal
    ) -> TrackedFrame:
        """Judge a pose as it stands, without moving it, by the surface that is seen there.

        Measured freely, a surface tells whether the pose is the right one, but fixes it less well
        than a bone that is followed: only the stage's tolerance counts.
        """
        pose = self._rectified(left_from_bone)
        pair, timings = self._rectified_pair(left, right, pose, NEAR_VIEW)
        measured = self._meter.freely(pair, pose, self.settings.locator.tracking)
        if measured is None:
            return self._fit_judge.lost(Reason.OUT_OF_VIEW)
        estimate = estimate_at(measured.scene, self.model, pose, STEREO_SETTINGS)
        fit = Fit(estimate, measured, measured.timings)
        return self._fit_judge.judged(pair, fit, replace(goal, seen_mm=math.inf), timings)

    def _cause(
        self,
        left: Image,
        right: Image,
        expected: RigidTransform,
        state: TrackState,
        tracked: TrackedFrame,
    ) -> Reason | None:
        """What is wrong for good: as known, or looked for anew in some of the lost frames."""
        is_lost = tracked.verdict.status is Status.LOST
        if not is_lost and state.cause is Reason.PICTURES_SWAPPED:
            # Swapped pictures show no bone: they are no longer.
            return None
        is_known = state.cause not in (None, Reason.PICTURES_SWAPPED)
        if not is_lost or is_known or state.n_lost % _LOST_BETWEEN != 0:
            return state.cause
        return self._causes.of_loss(left, right, expected)

    def _rectified_pair(
        self, left: Image, right: Image, around: RigidTransform, margins: Margins = WIDE_VIEW
    ) -> tuple[RectifiedPair, LineTimings]:
        return self._meter.rectified(left, right, around, margins)

    def _rectified(self, left_from_bone: RigidTransform) -> RigidTransform:
        return self._meter.geometry.rectified_from_left @ left_from_bone
