"""The first registration: from a pose, picks, a box or a cone to judged poses, best first."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from navapp.geometry.transform import RigidTransform
from navapp.registration import (
    distinct,
    is_same_pose,
    make_far_starts,
    make_near_starts,
    select_poses,
)
from navapp.registration.verdict import Goal
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.picked_landmarks import find_rough_poses
from navapp.tracking.surface_meter import WIDE_BOX, Measurement
from navapp.values import Pick, Prior, Reason, Status, StereoPictures, Stopwatch, TrackedFrame
from navapp.values.progress import Progress, tell_part

if TYPE_CHECKING:
    from navapp.tracking.bimcc_tracker import BimccTracker

# A first registration tries near starts first, which is so much of the work of all; then far ones;
# then it looks for a bone that is partly buried.
_NEAR_PART, _FAR_PART = 0.05, 0.45


class FirstRegistration:
    """Finds one bone for the first time, with a tracker's meter, searches and judge."""

    def __init__(self, tracker: "BimccTracker") -> None:
        self._tracker, self._scorer = tracker, tracker.scorer

    def register(
        self, pictures: StereoPictures, prior: Prior, goal: Goal, on_progress: Progress
    ) -> list[TrackedFrame]:
        """Distinct candidates, best first; see `Tracker.register`."""
        tracker, watch = self._tracker, Stopwatch()
        bone = tracker.model.bone.name
        start = prior.left_from_bone.get(bone)
        if start is None and (picks := prior.picks_of(bone)):
            start = self._start_at_picks(pictures, picks)
            if start is None:
                return [tracker.judge.lost(Reason.NO_SURFACE, watch)]
        if start is not None:
            frame = tracker.begin(pictures, start, watch=watch)
            answers = self._register_around(replace(frame, on_progress=on_progress), goal)
        elif prior.has_start(bone):
            answers = self._register_anywhere(pictures, prior, goal, on_progress, watch)
            start = answers[0].left_from_bone
        else:
            return []
        if answers[0].verdict.status is Status.OK:
            return answers
        around = None if start is None else tracker.rectify_pose(start)
        cause = tracker.diagnosis.explain_failure(pictures, around, answers[0], on_progress)
        return [answer.with_cause(cause) for answer in answers]

    def _start_at_picks(
        self, pictures: StereoPictures, picks: Sequence[Pick]
    ) -> RigidTransform | None:
        """The pose that picked landmarks tell; None when too few of them are matched."""
        tracker = self._tracker
        poses = find_rough_poses(pictures, picks, tracker.meter)
        if len(poses) < 2:
            return poses[0] if poses else None

        def score(pose: RigidTransform) -> float:
            frame = tracker.begin(pictures, pose)
            measured = tracker.meter.measure_freely(frame.pair, frame.start, WIDE_BOX)
            if measured is None or len(measured.cloud) == 0:
                return -math.inf
            found = self._scorer.find_poses(measured, [frame.start])
            return max((one.score for one in found), default=-math.inf)

        return max(poses, key=score)

    def _register_around(self, frame: Frame, goal: Goal) -> list[TrackedFrame]:
        """Around a rough pose: near starts, far ones, partly buried, until one gives an OK."""
        tracker = self._tracker
        measured = tracker.meter.measure_freely(frame.pair, frame.start, WIDE_BOX)
        frame.watch.lap("stereo")
        if measured is None or len(measured.cloud) == 0:
            return [tracker.judge.lost(Reason.NO_SURFACE, frame.watch)]

        def fit_from(starts: list[RigidTransform], done: float, part: float) -> list[Fit]:
            told = tell_part(frame.on_progress, done, done + part)
            found = select_poses(self._scorer.find_poses(measured, starts, told))
            return [tracker.near.fit_nearby(frame, measured, pose) for pose in found]

        centre_mm = frame.start.apply(tracker.model.centre_mm)
        fits = fit_from(make_near_starts(frame.start, centre_mm), 0.0, _NEAR_PART)
        answers = self._look_again(frame, self._judge_distinct(frame, fits, goal), goal)
        if not _is_ok(answers):
            fits += fit_from(make_far_starts(frame.start, centre_mm), _NEAR_PART, _FAR_PART)
            answers = self._look_again(frame, self._judge_distinct(frame, fits, goal), goal)
        if not _is_ok(answers):
            buried = self._judge_buried(frame, measured, goal)
            is_doubted = self._is_doubted(buried, answers)
            answers = sorted([buried, *answers], key=lambda one: one.verdict.rank)
            if answers[0] is buried and not is_doubted:
                answers = self._look_again(frame, answers, goal)
        frame.on_progress(1.0)
        return answers

    def _look_again(
        self, frame: Frame, answers: list[TrackedFrame], goal: Goal
    ) -> list[TrackedFrame]:
        """With what the best one is without highlights, where that is OK."""
        if not answers:
            return []
        best, *others = answers
        pose = best.left_from_bone
        # What speaks against the best of several poses is not taken back by a second look.
        if pose is None or Reason.AMBIGUOUS in best.verdict.reasons:
            return answers
        # The bone is expected where it was found: the start may be far off.
        found = self._tracker.rectify_pose(pose)
        frame = replace(frame, predicted=found)
        return [self._tracker.look_again(frame, best, goal), *others]

    def _is_doubted(self, found: TrackedFrame, others: list[TrackedFrame]) -> bool:
        """Whether an answer at the same place has what no second look takes back."""
        pose, against = found.left_from_bone, {Reason.AMBIGUOUS, Reason.SIZE_DIFFERS}
        return pose is not None and any(
            one.left_from_bone is not None
            and is_same_pose(pose, one.left_from_bone, self._tracker.model.centre_mm)
            and not against.isdisjoint(one.verdict.reasons)
            for one in others
        )

    def _judge_buried(self, frame: Frame, measured: Measurement, goal: Goal) -> TrackedFrame:
        """The answer of the search for a bone that tissue continues."""
        told = tell_part(frame.on_progress, _NEAR_PART + _FAR_PART, 1.0)
        frame = replace(frame, on_progress=told)
        fit = self._tracker.buried.find_around(frame, measured)
        return self._tracker.judge.judge(frame, fit, goal)

    def _register_anywhere(
        self,
        pictures: StereoPictures,
        prior: Prior,
        goal: Goal,
        on_progress: Progress,
        watch: Stopwatch,
    ) -> list[TrackedFrame]:
        """In a box, or in the whole view, without a pose to start from."""
        tracker = self._tracker
        pair = tracker.whole_view.rectify(pictures.left, pictures.right, prior)
        watch.lap("rectify")
        scored = tracker.whole_view.find_poses(pair, prior, on_progress)
        watch.lap("estimate")
        poses = select_poses(scored)
        found = [self._fit_pose(Frame(pictures, pair, pose, watch)) for pose in poses]
        fits = [fit for fit in found if fit is not None]
        if not fits:
            return [tracker.judge.lost(Reason.NO_SURFACE, watch)]
        frame = Frame(pictures, pair, poses[0], watch)
        return self._look_again(frame, self._judge_distinct(frame, fits, goal), goal)

    def _fit_pose(self, frame: Frame) -> Fit | None:
        """What explains more: the model matched where it is expected, or what lies around it."""
        near = self._tracker.near
        fits = (*near.find_on_model(frame), near.find_freely(frame, WIDE_BOX))
        found = (fit for fit in fits if fit is not None)
        return max(found, key=self._scorer.score, default=None)

    def _judge_distinct(self, frame: Frame, fits: list[Fit], goal: Goal) -> list[TrackedFrame]:
        """Distinct answers, best first; the best says so when it is ambiguous."""
        fits = self._scorer.rank(fits)
        kept = distinct([fit.pose for fit in fits], self._tracker.model.centre_mm)
        # Checks of its own for each: several may have been fitted to one free measurement.
        return [self._tracker.judge.judge(frame, fit, goal) for fit in fits if fit.pose in kept]


def _is_ok(answers: list[TrackedFrame]) -> bool:
    return bool(answers) and answers[0].verdict.status is Status.OK
