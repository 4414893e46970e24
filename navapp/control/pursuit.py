"""The search for the stage's bone: first registration, candidates under review, accepted tracks."""

from dataclasses import dataclass, replace

from drivers.frames import StereoFrame
from navapp.control.executors import Executor, Job, JobCancelled
from navapp.geometry.directions import ViewCone
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.preop import build_aspects
from navapp.tracking import Goal, Tracker, TrackerSettings, TrackState, make_tracker
from navapp.values import (
    LineTimings,
    Plan,
    Prior,
    StageSpec,
    Status,
    TrackedFrame,
    Verdict,
)


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A pose under review.

    Attributes:
        track: where it is now.
        tracked: the line's newest answer for it.
        is_held: judged as it stands (proposed by hand), not followed.
        number: it is the n-th ...
        count: ... of how many.
    """

    track: TrackState
    tracked: TrackedFrame
    is_held: bool = False
    number: int = 1
    count: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """A first registration that runs, and the frame that it looks at."""

    job: Job[list[TrackedFrame]]
    frame: StereoFrame


@dataclass(frozen=True, slots=True, eq=False)
class SearchOutcome:
    """What a first registration found.

    Attributes:
        candidates: best first; may be empty.
        failure: the best answer when all were lost; None when no start was known.
    """

    candidates: tuple[Candidate, ...]
    failure: TrackedFrame | None = None


class Pursuit:
    """What is known of the bones of one session; one of them, the stage's, is looked for.

    Attributes:
        track_number: of the candidate or track by which the stage's bone is followed: the same from
            frame to frame, another after a new search or with another candidate.
    """

    def __init__(
        self,
        rig: StereoRig,
        plan: Plan,
        prior: Prior,
        settings: TrackerSettings,
        executor: Executor,
    ) -> None:
        self._rig = rig
        self._plan = plan
        self._prior = prior
        self._settings = settings
        self._executor = executor
        self._lines: dict[str, Tracker] = {}
        self._edged: set[str] = set()
        self._tracks: dict[str, TrackState] = {}
        self._candidates: list[Candidate] = []
        self._search: _Search | None = None
        self.track_number = 0

    @property
    def plan(self) -> Plan:
        """Of the session."""
        return self._plan

    @property
    def candidate(self) -> Candidate | None:
        """The pose under review."""
        return self._candidates[0] if self._candidates else None

    @property
    def progress(self) -> float | None:
        """Share done of the search that runs; None when none runs."""
        return None if self._search is None else self._search.job.progress

    @property
    def accepted(self) -> tuple[str, ...]:
        """Bones of which a pose was accepted, in that order."""
        return tuple(self._tracks)

    def is_planned(self, stage: StageSpec) -> bool:
        """The plan has a model of the stage's bone."""
        return stage.bone in self._plan.bones

    def is_accepted(self, stage: StageSpec) -> bool:
        """A pose of the stage's bone was accepted before."""
        return stage.bone in self._tracks

    def search(self, stage: StageSpec, frame: StereoFrame) -> bool:
        """Start a first registration on a frame, unless one runs; whether it was started."""
        if self._search is not None:
            return False
        goal, prior = self._goal(stage), self._prior
        job: Job[list[TrackedFrame]] = Job(
            lambda report: self._searching_line(stage).register(
                frame.left, frame.right, prior, goal, report
            )
        )
        self._search = _Search(job, frame)
        self._executor.start(job)
        return True

    def take_over(self, next_sequence: int) -> SearchOutcome | None:
        """Bring the answers of a finished search under review; None while nothing is due."""
        search = self._search
        if search is None or not self._executor.take_due(search.job, next_sequence):
            return None
        self._search = None
        self.track_number += 1
        if isinstance(search.job.error, JobCancelled):
            return None
        if search.job.error is not None:
            raise search.job.error
        answers = search.job.result or []
        found = [
            (answer, answer.left_from_bone)
            for answer in answers
            if answer.verdict.status is not Status.LOST
        ]
        captured_ns = search.frame.captured_ns
        self._candidates = [
            Candidate(
                TrackState.at_rest(pose, captured_ns, answer.verdict.cause),
                answer,
                False,
                number,
                len(found),
            )
            for number, (answer, pose) in enumerate(found, start=1)
            if pose is not None
        ]
        best_lost = answers[0] if answers and not self._candidates else None
        return SearchOutcome(tuple(self._candidates), best_lost)

    def drop(self) -> None:
        """Stop the search and forget the candidates; accepted tracks stay."""
        if self._search is not None:
            self._search.job.cancel()
            self._search = None
        self._candidates = []
        self.track_number += 1

    def propose(self, stage: StageSpec, pose: RigidTransform, now_ns: int) -> None:
        """Put a pose under review that will be judged as it stands."""
        self.drop()
        track = TrackState.at_rest(pose, now_ns)
        self._candidates = [Candidate(track, _unjudged(stage.bone), is_held=True)]

    def forget_verdict(self) -> None:
        """The candidates must be judged anew before one can be accepted."""
        self._candidates = [
            replace(candidate, tracked=_unjudged(candidate.tracked.bone))
            for candidate in self._candidates
        ]

    def accept(self, stage: StageSpec) -> None:
        """The candidate is the bone's pose from now on."""
        self._tracks[stage.bone] = self._candidates[0].track
        self._candidates = []

    def reject(self) -> Candidate:
        """Take the candidate out; the next one, if any, comes under review."""
        self.track_number += 1
        return self._candidates.pop(0)

    def review(self, stage: StageSpec, frame: StereoFrame) -> TrackedFrame:
        """Follow the candidate into a frame, or judge a proposed pose where it stands."""
        candidate = self._candidates[0]
        line, goal, track = self._line(stage), self._goal(stage), candidate.track
        if candidate.is_held:
            tracked = line.assess(frame.left, frame.right, track.left_from_bone, goal)
        else:
            tracked, track = line.track(frame.left, frame.right, frame.captured_ns, track, goal)
        self._candidates[0] = replace(candidate, tracked=tracked, track=track)
        return tracked

    def follow(self, stage: StageSpec, frame: StereoFrame) -> TrackedFrame:
        """Follow the accepted bone into a frame."""
        line, track, goal = self._line(stage), self._tracks[stage.bone], self._goal(stage)
        tracked, track = line.track(frame.left, frame.right, frame.captured_ns, track, goal)
        self._tracks[stage.bone] = track
        return tracked

    def glance(
        self, stage: StageSpec, frame: StereoFrame, moved: RigidTransform | None
    ) -> TrackedFrame:
        """Follow an accepted bone into a frame if it is near where it is expected.

        Args:
            stage: whose bone, and by whose goal.
            frame: the next one.
            moved: in the left camera, how something that the bone goes with has moved meanwhile.
        """
        line, track, goal = self._line(stage), self._tracks[stage.bone], self._goal(stage)
        if moved is not None:
            track = track.carried(moved)
        tracked, track = line.glance(frame.left, frame.right, frame.captured_ns, track, goal)
        self._tracks[stage.bone] = track
        return tracked

    def register_now(self, stage: StageSpec, frame: StereoFrame) -> TrackedFrame:
        """Register a bone without a review: the best answer, if not lost, is its pose from now on.

        For replays, where nobody is there to be asked.
        """
        left, right, goal = frame.left, frame.right, self._goal(stage)
        answers = self._searching_line(stage).register(left, right, self._prior, goal)
        best = answers[0] if answers else _unjudged(stage.bone)
        pose, verdict = best.left_from_bone, best.verdict
        if pose is not None and verdict.status is not Status.LOST:
            track = TrackState.at_rest(pose, frame.captured_ns, verdict.cause)
            self._tracks[stage.bone] = track
        return best

    def _searching_line(self, stage: StageSpec) -> Tracker:
        """The bone's line, which knows its edges when there is no pose to start from."""
        name, prior = stage.bone, self._prior
        axis = prior.axis_for(name)
        if name in prior.left_from_bone or axis is None or name in self._edged:
            return self._line(stage)
        bone, built = self._plan.bones[name], self._plan.aspects.get(name)
        if built is None:
            aspects = build_aspects(bone, axis, prior.approach_half_angle_deg)
        else:
            aspects = built.within(ViewCone(axis, prior.approach_half_angle_deg))
        line = make_tracker(self._rig, bone, self._settings, aspects)
        self._lines[name] = line
        self._edged.add(name)
        return line

    def _line(self, stage: StageSpec) -> Tracker:
        name = stage.bone
        if name not in self._lines:
            self._lines[name] = make_tracker(self._rig, self._plan.bones[name], self._settings)
        return self._lines[name]

    def _goal(self, stage: StageSpec) -> Goal:
        return Goal(self._plan.targets_of(stage.targets), stage.tolerance_mm)


def _unjudged(bone: str) -> TrackedFrame:
    """Of a pose that no frame has judged: it counts as lost and cannot be accepted."""
    return TrackedFrame(bone, None, Verdict(Status.LOST), LineTimings())
