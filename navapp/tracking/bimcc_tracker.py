"""The production tracker: stereo on the model's own surface, BiMCC-ICP, and a judge.

Source: the paper's proposed system, section 3.2 and figure 2: the steps of `BimccTracker.track` are
its intra-operative stage. How they differ from it, and why, is told in docs/how/registration.md.
"""

from collections.abc import Iterable
from dataclasses import replace

from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.registration.verdict import (
    Goal,
    is_little_occluded,
    is_misfit,
    is_place_doubted,
    is_worth_a_second_look,
)
from navapp.tracking.first_registration import FirstRegistration
from navapp.tracking.frame import Fit, Frame, ignore
from navapp.tracking.motion import TrackState, is_worth_a_search
from navapp.tracking.search.after_loss import SearchAfterLoss
from navapp.tracking.search.buried import BuriedSearch
from navapp.tracking.search.highlights import HighlightSearch
from navapp.tracking.search.near import NearSearch
from navapp.tracking.search.whole_view import WholeViewSearch
from navapp.tracking.settings import TrackerSettings
from navapp.tracking.surface_meter import WIDE_VIEW, SurfaceMeter
from navapp.tracking.tracker import Tracker
from navapp.values import (
    AspectGraph,
    BoneModel,
    Prior,
    Reason,
    Status,
    StereoPictures,
    TrackedFrame,
    Verdict,
)
from navapp.values.progress import Progress


class BimccTracker(Tracker):
    """Finds and follows one bone under one rig.

    `aspects`, edges of the bone, are for a first registration without a pose: without them it goes
    by the measured surface alone, which finds the bone in a box, but less often in the whole view
    (docs/how/registration.md).
    """

    def __init__(
        self,
        rig: StereoRig,
        bone: BoneModel,
        settings: TrackerSettings | None = None,
        aspects: AspectGraph | None = None,
        meter: SurfaceMeter | None = None,
    ) -> None:
        super().__init__(rig, bone, settings, meter)
        meter, scorer = self.meter, self.scorer
        left_out = self.settings.leaves_out
        self.tells_foreground = "fill" not in left_out
        self.near = NearSearch(meter, scorer.score)
        self.highlights = HighlightSearch(meter)
        self._looks_again = "second look" not in left_out
        self.buried = BuriedSearch(meter)
        self.after_loss = SearchAfterLoss(meter, self.near, scorer)
        self.whole_view = WholeViewSearch(meter, aspects)

    def track(
        self, pictures: StereoPictures, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame (the paper's section 3.2, intra-operative)."""
        # Predict where the bone will be; rectify its box and depth band: the model's projection is
        # the box of section 3.2.1.
        frame = self.begin_predicted(pictures, state)
        if state.n_lost == 0:
            best = self._follow(frame, state, goal)
            best = self.follow_closer(frame, best, lambda again: self._follow(again, state, goal))
        else:
            best = self.look_near(frame, goal)
        if _is_searched_after_loss(best.verdict, state):
            # Search where the box lies, and where the bone was expected.
            box = self.boxes.follow(state.box, pictures.left)
            expected = state.predict(pictures.captured_ns, self.model.centre_mm)
            places = self.boxes.starts(expected, box)
            best = self._search_places(frame, places, state.n_searches, goal, best)
            state = replace(state, box=box, n_searches=state.n_searches + 1)
        best = best.with_cause(self.find_cause(frame, state, best))
        # Update the motion, and the box.
        return self.update(best, state, frame)

    def _follow(self, frame: Frame, state: TrackState, goal: Goal) -> TrackedFrame:
        """The bone near the start of a frame."""
        with self.begin_checks(frame) as checks:
            frame = replace(frame, checks=checks)
            if state.is_glossy:
                # What is mirrored will lead astray again.
                best = self._judge_matte(frame, frame.start, goal)
                if best.verdict.status is Status.OK and is_little_occluded(best.verdict):
                    return best
            # Measure on the model (section 3.2.2, algorithm 2) and fit (equations 4 to 9), in
            # turns; check beside the fit; judge.
            best = self.judge_fits(
                frame, self.near.find(frame), goal,
                is_enough=lambda verdict: not _asks_for_more(verdict, state),
            )  # fmt: skip
            best = self.look_again(frame, best, goal)
            if is_misfit(best.verdict) and state.is_search_due and is_worth_a_search(best):
                buried = [self.judge.judge(frame, fit, goal) for fit in self.buried.find(frame)]
                best = min([best, *buried], key=lambda one: one.verdict.rank)
        return best

    def _search_places(
        self,
        frame: Frame,
        places: Iterable[RigidTransform],
        n_searches: int,
        goal: Goal,
        best: TrackedFrame,
    ) -> TrackedFrame:
        """The best of an answer and of searches around places (left camera from bone), until an OK.

        Only around the first place a search goes further off, as `n_searches` asks for.
        """
        for number, place in enumerate(places):
            there = self.begin(
                frame.pictures, place, WIDE_VIEW, frame.watch, frame.times, frame.predicted
            )
            fits = self.after_loss.find(there, 0 if number else n_searches)
            best = self.judge_fits(there, fits, goal, best)
            if best.verdict.status is Status.OK:
                break
        return best

    def look_again(self, frame: Frame, answer: TrackedFrame, goal: Goal) -> TrackedFrame:
        """What the same pictures say without what is mirrored in the bone, if OK and better.

        Else the answer as it is: of two that are refused the first has seen more. One that surely
        saw another size stays: without highlights less of the surface is left to tell it.

        Args:
            frame: of the answer.
            answer: looked at again when it is DEGRADED or fits loosely, and little hides the bone.
            goal: of the stage.
        """
        pose = answer.left_from_bone
        is_worth_it = self._looks_again and is_worth_a_second_look(answer.verdict)
        if pose is None or not is_worth_it or Reason.SIZE_DIFFERS in answer.verdict.reasons:
            return answer
        again = self._judge_matte(frame, self.rectify_pose(pose), goal)
        before, after = answer.verdict, again.verdict
        is_better = before.status is not Status.OK or after.spread_ratio <= before.spread_ratio
        return again if after.status is Status.OK and is_better else answer

    def _judge_matte(self, frame: Frame, pose: RigidTransform, goal: Goal) -> TrackedFrame:
        """The bone near a pose, in pictures without highlights; lost where none are seen."""
        answer = self.judge_fits(frame, self.highlights.find(frame, pose), goal)
        return replace(answer, is_matte=True)

    def find_for_glance(self, frame: Frame) -> Iterable[Fit | None]:
        """Where the model itself rests next to the start; nothing is measured around it."""
        return self.near.find_on_model(frame)

    def register(
        self, pictures: StereoPictures, prior: Prior, goal: Goal, on_progress: Progress = ignore
    ) -> list[TrackedFrame]:
        """Find the bone from a rough pose, a box or a cone: distinct candidates, best first."""
        return FirstRegistration(self).register(pictures, prior, goal, on_progress)


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
