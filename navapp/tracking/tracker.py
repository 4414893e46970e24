"""What every tracker does: find one bone in pairs of pictures, and follow it."""

import math
import operator
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

from navapp.geometry.bands import begin_on_helper
from navapp.geometry.rectification import Image
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import RegistrationModel, estimate_at
from navapp.registration.verdict import Goal, is_place_doubted
from navapp.tracking.box.tracker import BoxTracker
from navapp.tracking.checks import PairChecks
from navapp.tracking.diagnosis import Diagnosis
from navapp.tracking.frame import FREE_SETTINGS, Fit, Frame, RectifyBox, ignore
from navapp.tracking.judging import PoseJudge
from navapp.tracking.motion import TrackState
from navapp.tracking.outline import NoOutline
from navapp.tracking.row_times import RowTimes
from navapp.tracking.scoring import FitScorer
from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, WIDE_VIEW, Margins, SurfaceMeter
from navapp.values import BoneModel, Prior, Reason, Status, Stopwatch, TrackedFrame, Verdict

Method = Literal["bimcc", "paper", "icp"]
# What can be left out of the production chain, to see what it is worth.
Part = Literal["fill", "backward pairs", "contour", "second look", "judge"]

# So often, in lost frames, it is asked whether the pictures are swapped; chosen.
_FRAMES_BETWEEN_DIAGNOSES = 10


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """How a tracker works; chosen."""

    # `bimcc` is the production chain; `paper` is the paper's proposal, `icp` its state of the art.
    method: Method = "bimcc"
    # A pose that the judge refuses is carried on too, to be measured; it stays refused.
    follows_refused: bool = False
    # nearest and farthest surface that the rig is used for.
    depth_mm: tuple[float, float] = (300.0, 700.0)
    max_points: int = 2500  # about so many measured points enter a fit
    # parts of `bimcc` that are not made; nothing but an evaluation asks for that.
    leaves_out: frozenset[Part] = frozenset()


class Tracker(ABC):
    """Finds and follows one bone under one rig.

    `register`, `track`, `glance` and `assess` are what the controller asks for; the other methods
    are what trackers share. `left` and `right` are a pair. What is remembered
    travels in a `TrackState`: a tracker keeps nothing of a frame.

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
        judge: PoseJudge | None = None,
        diagnosis: Diagnosis | None = None,
        meter: SurfaceMeter | None = None,
    ) -> None:
        self.settings = settings or TrackerSettings()
        depth_mm, max_points = self.settings.depth_mm, self.settings.max_points
        left_out = self.settings.leaves_out
        self.meter = meter or SurfaceMeter(
            rig, RegistrationModel(bone), depth_mm, max_points,
            pairs_backward="backward pairs" not in left_out,
        )  # fmt: skip
        self.model = self.meter.model
        self.judge = judge or PoseJudge(
            self.meter,
            rig.quality,
            NoOutline() if "contour" in left_out else None,
            tells_refused=self.settings.follows_refused,
            believes_all="judge" in left_out,
        )
        self.boxes = BoxTracker(rig, self.model)
        self.scorer = FitScorer(self.meter)
        self.diagnosis = diagnosis or Diagnosis(self.meter, self.scorer)

    @property
    def centre_mm(self) -> FloatArray:
        """(3,) mean of the model's vertices, in bone coordinates."""
        return self.model.centre_mm

    @abstractmethod
    def register(
        self,
        left: Image,
        right: Image,
        prior: Prior,
        goal: Goal,
        on_progress: Callable[[float], None] = ignore,
    ) -> list[TrackedFrame]:
        """Find the bone: distinct candidates, best first.

        From the prior's pose of this bone; without one from its picks, its box, its cone, or both
        of these. Progress is a fraction; what it raises stops the search.
        """

    @abstractmethod
    def track(
        self,
        left: Image,
        right: Image,
        captured_ns: int,
        state: TrackState,
        goal: Goal,
        skew_ns: int = 0,
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame, and search for it when it is lost.

        The right picture is exposed later than the left one by `skew_ns`.
        """

    @abstractmethod
    def find_for_glance(self, frame: Frame) -> Iterable[Fit | None]:
        """The fits that are soon found near the start of a frame."""

    def glance(
        self,
        left: Image,
        right: Image,
        captured_ns: int,
        state: TrackState,
        goal: Goal,
        skew_ns: int = 0,
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame without any search, lost or not.

        It takes a frame's time or two, and sees no further than some millimetres.
        """
        watch = Stopwatch()
        left_from_bone = state.predict(captured_ns, self.centre_mm)
        times = RowTimes.of_pair(self.meter, state, captured_ns, skew_ns)
        frame = self.begin(left, right, left_from_bone, watch, NEAR_VIEW, times)
        best = self.look_near(frame, goal)
        tracked, after = self.update(best.with_cause(state.cause), state, left, captured_ns, watch)
        # Nothing was searched for, so the next search is due at once.
        return tracked, replace(after, n_doubted=0)

    def look_near(self, frame: Frame, goal: Goal) -> TrackedFrame:
        """The bone near the start of a frame, without any search."""
        with self.begin_checks(frame) as checks:
            fits = self.find_for_glance(frame)
            return self.judge_fits(
                frame, fits, goal, frame.start, checks=checks,
                is_enough=lambda verdict: not is_place_doubted(verdict),
            )  # fmt: skip

    def assess(
        self, left: Image, right: Image, left_from_bone: RigidTransform, goal: Goal
    ) -> TrackedFrame:
        """Judge a pose as it stands, without moving it.

        The surface is measured freely. That tells whether the pose is the right one, but fixes it
        less well than following does: only the stage's tolerance counts.
        """
        frame = self.begin(left, right, left_from_bone, Stopwatch(), NEAR_VIEW)
        measured = self.meter.measure_freely(frame.pair, frame.start, NEAR_BOX)
        frame.watch.lap("stereo")
        if measured is None:
            return self.judge.lost(Reason.OUT_OF_VIEW, frame.watch)
        fit = Fit(estimate_at(measured.scene, self.model, frame.start, FREE_SETTINGS), measured)
        frame.watch.lap("estimate")
        return self.judge.judge(frame, fit, replace(goal, seen_limit_mm=math.inf))

    def rectify_pose(self, left_from_bone: RigidTransform) -> RigidTransform:
        """A pose in the rectified left camera."""
        return self.meter.geometry.rectified_from_left @ left_from_bone

    def begin(
        self,
        left: Image,
        right: Image,
        left_from_bone: RigidTransform,
        watch: Stopwatch,
        margins: Margins = WIDE_VIEW,
        times: RowTimes | None = None,
    ) -> Frame:
        """Both pictures, rectified around an expected bone, as at one time if `times` are given."""
        start = self.rectify_pose(left_from_bone)
        shifts_px = None if times is None else times.find_shifts(start)
        pair = self.meter.rectify(left, right, start, margins, shifts_px)
        watch.lap("rectify")
        nearer = self.meter.make_nearer_search(left, right)
        coloured = self.colours_of(left, right, shifts_px)
        return Frame(pair, start, watch, nearer, coloured, times)

    def colours_of(
        self, left: Image, right: Image, shifts_px: tuple[FloatArray, FloatArray] | None = None
    ) -> RectifyBox | None:
        """How boxes of two pictures are rectified in their colours; None of grey ones."""
        if left.ndim == 2:
            return None
        return partial(self.meter.rectifier.rectify, left, right, row_shifts_px=shifts_px)

    def begin_checks(self, frame: Frame) -> PairChecks:
        """Checks of a frame in which the bone is expected near the start, begun at once."""
        # What may hide the bone does not depend on where exactly it is.
        coarse = begin_on_helper(lambda: self.meter.measure_coarsely(frame.pair, frame.start))
        nearer = frame.nearer if self.tells_foreground else None
        return PairChecks(self.meter, frame.pair, coarse, nearer)

    def judge_fits(
        self,
        frame: Frame,
        fits: Iterable[Fit | None],
        goal: Goal,
        predicted: RigidTransform,
        best: TrackedFrame | None = None,
        checks: PairChecks | None = None,
        keeps_first: bool = False,
        is_enough: Callable[[Verdict], bool] = lambda verdict: verdict.status is Status.OK,
    ) -> TrackedFrame:
        """The best of an answer and of fits, which are asked for until one is good enough.

        Args:
            frame: that they are fitted in.
            fits: None is a bone out of view.
            goal: of the stage.
            predicted: pose in the rectified left camera that the motion lets expect.
            best: answer so far; without one, and without fits, the bone is lost.
            checks: of the frame, begun; made for these fits without.
            keeps_first: of equally good answers the first is kept; by default the last.
            is_enough: no further fit is asked for.
        """
        is_better = operator.lt if keeps_first else operator.le
        checks = checks or PairChecks(self.meter, frame.pair)
        for fit in fits:
            answer = self.judge.judge(frame, fit, goal, predicted, checks)
            if best is None or is_better(answer.verdict.rank, best.verdict.rank):
                best = answer
            if is_enough(answer.verdict):
                break
        return best or self.judge.lost_in(frame)

    def search_places(
        self,
        left: Image,
        right: Image,
        places: Iterable[RigidTransform],
        find: Callable[[Frame], Iterable[Fit | None]],
        goal: Goal,
        predicted: RigidTransform,
        best: TrackedFrame,
        watch: Stopwatch,
        n_searches: int = 0,
        times: RowTimes | None = None,
    ) -> TrackedFrame:
        """The best of an answer and of searches around places (left camera from bone), until an OK.

        Only around the first place a search goes further off, as `n_searches` asks for.
        """
        for number, place in enumerate(places):
            frame = self.begin(left, right, place, watch, times=times)
            frame = replace(frame, n_searches=0 if number else n_searches)
            best = self.judge_fits(frame, find(frame), goal, predicted, best)
            if best.verdict.status is Status.OK:
                break
        return best

    def find_cause(
        self,
        left: Image,
        right: Image,
        left_from_bone: RigidTransform,
        state: TrackState,
        tracked: TrackedFrame,
    ) -> Reason | None:
        """What is wrong for good: as known, or looked for anew in some of the lost frames."""
        is_lost = tracked.verdict.status is Status.LOST and not self.settings.follows_refused
        if not is_lost and state.cause is Reason.PICTURES_SWAPPED:
            # The bone is seen again, so the pictures are no longer swapped.
            return None
        is_known = state.cause not in (None, Reason.PICTURES_SWAPPED)
        if not is_lost or is_known or state.n_lost % _FRAMES_BETWEEN_DIAGNOSES != 0:
            return state.cause
        return self.diagnosis.explain_loss(left, right, self.rectify_pose(left_from_bone))

    def update(
        self,
        tracked: TrackedFrame,
        state: TrackState,
        left: Image,
        captured_ns: int,
        watch: Stopwatch,
    ) -> tuple[TrackedFrame, TrackState]:
        """The answer with its times, and the state after it."""
        carries = self.settings.follows_refused
        after = state.update(tracked, captured_ns, self.centre_mm, follows_refused=carries)
        # What is not followed does not place the box either.
        box = self.boxes.place(state.box, left, tracked) if after.n_lost == 0 else state.box
        return replace(tracked, timings=watch.timings), replace(after, box=box)
