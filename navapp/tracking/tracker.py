"""What every tracker does: find one bone in pairs of pictures, and follow it."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import replace

from navapp.geometry.bands import begin_on_helper
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel, solution_at
from navapp.registration.verdict import Goal, is_place_doubted
from navapp.tracking.box.tracker import BoxTracker
from navapp.tracking.checks import PairChecks
from navapp.tracking.diagnosis import Diagnosis
from navapp.tracking.frame import FREE_SETTINGS, Fit, Frame, ignore
from navapp.tracking.judging import PoseJudge
from navapp.tracking.motion import TrackState
from navapp.tracking.row_times import RowTimes
from navapp.tracking.scoring import FitScorer
from navapp.tracking.settings import TrackerSettings
from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, WIDE_VIEW, Margins, SurfaceMeter
from navapp.values import (
    BoneModel,
    Prior,
    Reason,
    Status,
    StereoPictures,
    Stopwatch,
    TrackedFrame,
    Verdict,
)
from navapp.values.progress import Progress

# So often, in lost frames, it is asked whether the pictures are swapped; chosen.
_FRAMES_BETWEEN_DIAGNOSES = 10


class Tracker(ABC):
    """Finds and follows one bone under one rig.

    `register`, `track`, `glance` and `assess` are what the controller asks for; the other methods
    are what trackers share. What is remembered travels in a `TrackState`: a tracker keeps nothing
    of a frame.

    Attributes:
        tells_foreground: a followed frame tells what stands in front of the bone.
        settings: of the tracker.
        model: of the bone.
        meter: of its surface.
        judge: of its poses.
        boxes: its box in the left pictures.
        scorer: tells how much of the model a fit explains.
        diagnosis: why the bone is not found.
    """

    tells_foreground = False

    def __init__(
        self,
        rig: StereoRig,
        bone: BoneModel,
        settings: TrackerSettings | None = None,
        meter: SurfaceMeter | None = None,
    ) -> None:
        self.settings = settings or TrackerSettings()
        pairs_backward = "backward pairs" not in self.settings.leaves_out
        self.meter = meter or SurfaceMeter(
            rig, RegistrationModel(bone, pairs_backward=pairs_backward), self.settings.depth_mm
        )
        self.model = self.meter.model
        self.judge = PoseJudge(self.meter, self.settings)
        self.boxes = BoxTracker(rig, self.model)
        self.scorer = FitScorer(self.meter)
        self.diagnosis = Diagnosis(self.meter, self.scorer)

    @abstractmethod
    def register(
        self, pictures: StereoPictures, prior: Prior, goal: Goal, on_progress: Progress = ignore
    ) -> list[TrackedFrame]:
        """Find the bone: distinct candidates, best first.

        From the prior's pose of this bone; without one from its picks, its box, its cone, or both
        of these. What progress raises stops the search.
        """

    @abstractmethod
    def track(
        self, pictures: StereoPictures, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame, and search for it when it is lost."""

    @abstractmethod
    def find_for_glance(self, frame: Frame) -> Iterable[Fit | None]:
        """The fits that are soon found near the start of a frame."""

    def glance(
        self, pictures: StereoPictures, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame without any search, lost or not.

        It takes a frame's time or two, and sees no further than some millimetres.
        """
        frame = self.begin_predicted(pictures, state)
        best = self.look_near(frame, goal)
        tracked, after = self.update(best.with_cause(state.cause), state, frame)
        # Nothing was searched for: where it is in doubt, the next search is due at once.
        return tracked, replace(after, n_doubted=min(after.n_doubted, 1))

    def look_near(self, frame: Frame, goal: Goal) -> TrackedFrame:
        """The bone near the start of a frame, without any search."""
        with self.begin_checks(frame) as checks:
            return self.judge_fits(
                replace(frame, checks=checks), self.find_for_glance(frame), goal,
                is_enough=lambda verdict: not is_place_doubted(verdict),
            )  # fmt: skip

    def follow_closer(
        self, frame: Frame, answer: TrackedFrame, follow: Callable[[Frame], TrackedFrame]
    ) -> TrackedFrame:
        """Once more where a found pose shows another motion during the exposure than was expected.

        That answer of `follow` counts: the first one took a motion that is known to be wrong.
        """
        pose, verdict = answer.left_from_bone, answer.verdict
        is_doubted = is_place_doubted(verdict) or Reason.JUMPED in verdict.reasons
        if frame.times is None or pose is None or is_doubted:
            return answer
        times = frame.times.with_motion_to(self.rectify_pose(pose))
        if times is None:
            return answer
        again = self.begin(frame.pictures, pose, NEAR_VIEW, frame.watch, times, frame.predicted)
        return follow(again)

    def assess(
        self, pictures: StereoPictures, left_from_bone: RigidTransform, goal: Goal
    ) -> TrackedFrame:
        """Judge a pose as it stands, without moving it.

        The surface is measured freely. That tells whether the pose is the right one, but fixes it
        less well than following does: only the stage's tolerance counts.
        """
        frame = self.begin(pictures, left_from_bone, NEAR_VIEW)
        measured = self.meter.measure_freely(frame.pair, frame.start, NEAR_BOX)
        frame.watch.lap("stereo")
        if measured is None:
            return self.judge.lost(Reason.OUT_OF_VIEW, frame.watch)
        found = solution_at(measured.scene, self.model, frame.start, FREE_SETTINGS)
        fit = Fit(found.estimate, measured)
        frame.watch.lap("estimate")
        return self.judge.judge(frame, fit, replace(goal, seen_limit_mm=math.inf))

    def rectify_pose(self, left_from_bone: RigidTransform) -> RigidTransform:
        """A pose in the rectified left camera."""
        return self.meter.geometry.rectified_from_left @ left_from_bone

    def begin(
        self,
        pictures: StereoPictures,
        left_from_bone: RigidTransform,
        margins: Margins = WIDE_VIEW,
        watch: Stopwatch | None = None,
        times: RowTimes | None = None,
        predicted: RigidTransform | None = None,
    ) -> Frame:
        """Both pictures, rectified around an expected bone, as at one time if `times` are given.

        `predicted` is that of the frame: without it no jump is noticed.
        """
        watch, start = watch or Stopwatch(), self.rectify_pose(left_from_bone)
        shifts_px = None if times is None else times.find_shifts(start)
        pair = self.meter.rectify(pictures.left, pictures.right, start, margins, shifts_px)
        watch.lap("rectify")
        return Frame(pictures, pair, start, watch, predicted, times=times, row_shifts_px=shifts_px)

    def begin_predicted(self, pictures: StereoPictures, state: TrackState) -> Frame:
        """Both pictures, rectified around where the motion lets expect the bone."""
        left_from_bone = state.predict(pictures.captured_ns, self.model.centre_mm)
        times = RowTimes.of_pair(self.meter, state, pictures)
        predicted = self.rectify_pose(left_from_bone)
        return self.begin(pictures, left_from_bone, NEAR_VIEW, times=times, predicted=predicted)

    def begin_checks(self, frame: Frame) -> PairChecks:
        """Checks of a frame in which the bone is expected near the start, begun at once."""
        # What may hide the bone does not depend on where exactly it is.
        coarse = begin_on_helper(lambda: self.meter.measure_coarsely(frame.pair, frame.start))
        pictures, nearer = frame.pictures, None
        if self.tells_foreground:
            nearer = self.meter.make_nearer_search(pictures.left, pictures.right)
        return PairChecks(self.meter, frame.pair, coarse, nearer)

    def judge_fits(
        self,
        frame: Frame,
        fits: Iterable[Fit | None],
        goal: Goal,
        best: TrackedFrame | None = None,
        is_enough: Callable[[Verdict], bool] = lambda verdict: verdict.status is Status.OK,
    ) -> TrackedFrame:
        """The best of an answer and of fits, which are asked for until one is good enough.

        Args:
            frame: that they are fitted in.
            fits: None is a bone out of view.
            goal: of the stage.
            best: answer so far; without one, and without fits, the bone is lost.
            is_enough: no further fit is asked for.
        """
        if frame.checks is None:
            frame = replace(frame, checks=PairChecks(self.meter, frame.pair))
        for fit in fits:
            answer = self.judge.judge(frame, fit, goal)
            # Of equally good answers the last.
            if best is None or answer.verdict.rank <= best.verdict.rank:
                best = answer
            if is_enough(answer.verdict):
                break
        return best or self.judge.lost_in(frame)

    def find_cause(self, frame: Frame, state: TrackState, tracked: TrackedFrame) -> Reason | None:
        """What is wrong for good: as known, or looked for anew in some of the lost frames."""
        is_lost = tracked.verdict.status is Status.LOST and not self.settings.follows_refused
        if not is_lost and state.cause is Reason.PICTURES_SWAPPED:
            # The bone is seen again, so the pictures are no longer swapped.
            return None
        is_known = state.cause not in (None, Reason.PICTURES_SWAPPED)
        if not is_lost or is_known or state.n_lost % _FRAMES_BETWEEN_DIAGNOSES != 0:
            return state.cause
        return self.diagnosis.explain_loss(frame.pictures, frame.predicted)

    def update(
        self, tracked: TrackedFrame, state: TrackState, frame: Frame
    ) -> tuple[TrackedFrame, TrackState]:
        """The answer in a frame with its times, and the state after it."""
        carries, pictures = self.settings.follows_refused, frame.pictures
        after = state.update(
            tracked, pictures.captured_ns, self.model.centre_mm, follows_refused=carries
        )
        # What is not followed does not place the box either.
        is_followed = after.n_lost == 0
        box = self.boxes.place(state.box, pictures.left, tracked) if is_followed else state.box
        return replace(tracked, timings=frame.watch.timings), replace(after, box=box)
