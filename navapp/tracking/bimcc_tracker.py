"""The production tracker: stereo on the model's own surface, BiMCC-ICP, and a judge.

Source: the paper's proposed system, section 3.2 and figure 2: the steps of `BimccTracker.track` are
its intra-operative stage. How they differ from it, and why, is told in docs/how/registration.md.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

from navapp.geometry.rectification import Image
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.registration.verdict import (
    Goal,
    is_little_occluded,
    is_misfit,
    is_place_doubted,
    is_worth_a_second_look,
)
from navapp.tracking.checks import PairChecks
from navapp.tracking.diagnosis import Diagnosis
from navapp.tracking.first_registration import FirstRegistration
from navapp.tracking.frame import Fit, Frame, ignore
from navapp.tracking.judging import PoseJudge
from navapp.tracking.motion import TrackState, is_worth_a_search
from navapp.tracking.row_times import RowTimes
from navapp.tracking.search.after_loss import SearchAfterLoss
from navapp.tracking.search.buried import BuriedSearch
from navapp.tracking.search.highlights import HighlightSearch
from navapp.tracking.search.near import NearSearch
from navapp.tracking.search.whole_view import WholeViewSearch
from navapp.tracking.surface_meter import NEAR_VIEW, SurfaceMeter
from navapp.tracking.tracker import Tracker, TrackerSettings
from navapp.values import (
    AspectGraph,
    BoneModel,
    Prior,
    Reason,
    Status,
    Stopwatch,
    TrackedFrame,
    Verdict,
)


class BimccTracker(Tracker):
    """Finds and follows one bone under one rig.

    `aspects`, edges of the bone, are for a first registration without a pose: without them it goes
    by the measured surface alone, which finds the bone in a box, but less often in the whole view
    (docs/how/registration.md). The other parts have defaults; a test replaces them.
    """

    def __init__(
        self,
        rig: StereoRig,
        bone: BoneModel,
        settings: TrackerSettings | None = None,
        aspects: AspectGraph | None = None,
        *,
        meter: SurfaceMeter | None = None,
        judge: PoseJudge | None = None,
        near: NearSearch | None = None,
        highlights: HighlightSearch | None = None,
        buried: BuriedSearch | None = None,
        after_loss: SearchAfterLoss | None = None,
        diagnosis: Diagnosis | None = None,
    ) -> None:
        super().__init__(rig, bone, settings, judge, diagnosis, meter)
        meter, scorer = self.meter, self.scorer
        left_out = self.settings.leaves_out
        self.tells_foreground = "fill" not in left_out
        self.near = near or NearSearch(meter, scorer.score)
        self.highlights = highlights or HighlightSearch(meter)
        self._looks_again = "second look" not in left_out
        self.buried = buried or BuriedSearch(meter)
        self.after_loss = after_loss or SearchAfterLoss(meter, self.near, scorer)
        self.whole_view = WholeViewSearch(meter, aspects)

    def track(
        self,
        left: Image,
        right: Image,
        captured_ns: int,
        state: TrackState,
        goal: Goal,
        skew_ns: int = 0,
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame (the paper's section 3.2, intra-operative)."""
        watch = Stopwatch()
        # Predict where the bone will be.
        left_from_bone = state.predict(captured_ns, self.centre_mm)
        times = RowTimes.of_pair(self.meter, state, captured_ns, skew_ns)
        # Rectify its box and depth band; the model's projection is the box of section 3.2.1.
        frame = self.begin(left, right, left_from_bone, watch, NEAR_VIEW, times)
        if state.n_lost == 0:
            best = self._follow(frame, state, goal, frame.start)
            best = self._follow_closer(left, right, frame, best, state, goal)
        else:
            best = self.look_near(frame, goal)
        if _is_searched_after_loss(best.verdict, state):
            n_searches, box = state.n_searches, self.boxes.follow(state.box, left)
            state = replace(state, box=box, n_searches=n_searches + 1)
            # Search where the box lies, and where the bone was expected.
            best = self.search_places(
                left, right, self.boxes.starts(left_from_bone, state.box), self.after_loss.find,
                goal, frame.start, best, watch, n_searches, times,
            )  # fmt: skip
        if best.verdict.status is not Status.OK:
            best = best.with_cause(self.find_cause(left, right, left_from_bone, state, best))
        # Update the motion, and the box.
        return self.update(best, state, left, captured_ns, watch)

    def _follow_closer(
        self,
        left: Image,
        right: Image,
        frame: Frame,
        answer: TrackedFrame,
        state: TrackState,
        goal: Goal,
    ) -> TrackedFrame:
        """Once more where the rows were exposed during another motion than was expected."""
        pose, verdict = answer.left_from_bone, answer.verdict
        is_doubted = is_place_doubted(verdict) or Reason.JUMPED in verdict.reasons
        if frame.times is None or pose is None or is_doubted:
            return answer
        times = frame.times.with_motion_to(self.rectify_pose(pose))
        if times is None:
            return answer
        again = self.begin(left, right, pose, frame.watch, NEAR_VIEW, times)
        closer = self._follow(again, state, goal, frame.start)
        return closer if closer.verdict.rank <= verdict.rank else answer

    def _follow(
        self, frame: Frame, state: TrackState, goal: Goal, predicted: RigidTransform
    ) -> TrackedFrame:
        """The bone near the start of a frame; `predicted` as of `judge_fits`."""
        with self.begin_checks(frame) as checks:
            if state.is_glossy:
                # What is mirrored will lead astray again.
                best = self._judge_matte(frame, frame.start, goal, predicted, checks)
                if best.verdict.status is Status.OK and is_little_occluded(best.verdict):
                    return best
            # Measure on the model (section 3.2.2, algorithm 2) and fit (equations 4 to 9), in
            # turns; check beside the fit; judge.
            frame = replace(frame, on_measured=checks.check)
            fits = self.near.find(frame)
            best = self.judge_fits(
                frame, fits, goal, predicted, checks=checks,
                is_enough=lambda verdict: not _asks_for_more(verdict, state),
            )  # fmt: skip
            best = self.look_again(frame, best, goal, predicted, checks)
            if is_misfit(best.verdict) and state.is_search_due and is_worth_a_search(best):
                more = self.buried.find(frame)
                best = self.judge_fits(frame, more, goal, predicted, best, checks, keeps_first=True)
        return best

    def look_again(
        self,
        frame: Frame,
        answer: TrackedFrame,
        goal: Goal,
        predicted: RigidTransform,
        checks: PairChecks | None = None,
    ) -> TrackedFrame:
        """What the same pictures say without what is mirrored in the bone, if OK and better.

        Else the answer as it is: of two that are refused the first has seen more. One that surely
        saw another size stays: without highlights less of the surface is left to tell it.

        Args:
            frame: of the answer.
            answer: looked at again when it is DEGRADED or fits loosely, and little hides the bone.
            goal: of the stage.
            predicted: as of `judge_fits`.
            checks: as of `judge_fits`.
        """
        pose = answer.left_from_bone
        is_worth_it = self._looks_again and is_worth_a_second_look(answer.verdict)
        if pose is None or not is_worth_it or Reason.SIZE_DIFFERS in answer.verdict.reasons:
            return answer
        again = self._judge_matte(frame, self.rectify_pose(pose), goal, predicted, checks)
        before, after = answer.verdict, again.verdict
        is_better = before.status is not Status.OK or after.spread_ratio <= before.spread_ratio
        return again if after.status is Status.OK and is_better else answer

    def _judge_matte(
        self,
        frame: Frame,
        pose: RigidTransform,
        goal: Goal,
        predicted: RigidTransform,
        checks: PairChecks | None,
    ) -> TrackedFrame:
        """The bone near a pose, in pictures without highlights; lost where none are seen."""
        fits = self.highlights.find(frame, pose)
        answer = self.judge_fits(frame, fits, goal, predicted, checks=checks)
        return replace(answer, is_matte=True)

    def find_for_glance(self, frame: Frame) -> Iterable[Fit | None]:
        """Where the model itself rests next to the start; nothing is measured around it."""
        return self.near.find_on_model(frame)

    def register(
        self,
        left: Image,
        right: Image,
        prior: Prior,
        goal: Goal,
        on_progress: Callable[[float], None] = ignore,
    ) -> list[TrackedFrame]:
        """Find the bone from a rough pose, a box or a cone: distinct candidates, best first."""
        return FirstRegistration(self).register(left, right, prior, goal, on_progress)


def _is_searched_after_loss(verdict: Verdict, state: TrackState) -> bool:
    """Whether the bone is searched where it was not expected: in lost frames now and then.

    What is found after a loss and doubted ends the loss only if a search finds nothing better.
    """
    if verdict.status is Status.LOST:
        return state.is_search_after_loss_due
    return state.n_lost > 0 and is_place_doubted(verdict)


def _asks_for_more(verdict: Verdict, state: TrackState) -> bool:
    """Whether it is asked how the bone would fit elsewhere: while in doubt ever more rarely."""
    is_lost = verdict.status is Status.LOST
    return is_lost or (is_place_doubted(verdict) and state.is_search_due)
