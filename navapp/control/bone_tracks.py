"""Poses of the session's bones: accepted tracks, and candidates under review."""

from dataclasses import dataclass, replace

import numpy as np

from drivers.frames import StereoFrame
from navapp.control.registration_job import Registration
from navapp.control.trackers import Trackers
from navapp.geometry.transform import RigidTransform
from navapp.tracking import Tracker, TrackState
from navapp.values import FrameTimings, StageSpec, Status, TrackedFrame, Verdict

# Further than that within one delay of the display a patient does not move: chosen.
FARTHEST_PREDICTED_MM = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A pose of the stage's bone that waits for the operator's decision."""

    track: TrackState  # where it is now
    tracked: TrackedFrame  # the tracker's newest answer for it
    is_held: bool = False  # judged as it stands (proposed by hand), not followed
    number: int = 1  # this is candidate `number` ...
    count: int = 1  # ... of `count`


class BoneTracks:
    """The accepted track of each bone, and the candidates of the stage's bone.

    The first of them is under review; the others follow from best to worst.

    Args:
        trackers: of the bones.

    Attributes:
        track_number: of the candidate or track by which the stage's bone is followed: the same from
            frame to frame, another after a new search or with another candidate.
    """

    def __init__(self, trackers: Trackers) -> None:
        self._trackers = trackers
        self._tracks: dict[str, TrackState] = {}
        # Of bones that were found beside another one: nobody has accepted these.
        self._found: dict[str, TrackState] = {}
        self._candidates: list[Candidate] = []
        self._n_reviewed = 0
        self.track_number = 0

    @property
    def candidate(self) -> Candidate | None:
        """The pose under review."""
        return self._candidates[0] if self._candidates else None

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """All that are left, by their numbers."""
        return tuple(sorted(self._candidates, key=lambda one: one.number))

    @property
    def candidate_id(self) -> int | None:
        """Of the pose under review, another one for each of a session; None when there is none.

        It counts what came under review, which a replay of a recorded session does in the same way.
        """
        return self._n_reviewed if self._candidates else None

    @property
    def accepted(self) -> tuple[str, ...]:
        """Bones of which a pose was accepted, in that order."""
        return tuple(self._tracks)

    def is_accepted(self, stage: StageSpec) -> bool:
        """A pose of the stage's bone was accepted before."""
        return stage.bone in self._tracks

    def is_followed(self, stage: StageSpec) -> bool:
        """The stage's bone was accepted, or found beside another one."""
        return self.is_accepted(stage) or stage.bone in self._found

    def is_found(self, stage: StageSpec) -> bool:
        """It was found beside another one, and nobody has accepted it."""
        return stage.bone in self._found

    def take(self, stage: StageSpec, tracked: TrackedFrame, captured_ns: int) -> None:
        """Follow a stage's bone, found beside another one, from now on; nothing if it is lost.

        An accepted pose that it takes the place of is accepted no longer: nobody has seen this one.
        """
        pose, verdict = tracked.left_from_bone, tracked.verdict
        if pose is None or verdict.status is Status.LOST:
            return
        self._tracks.pop(stage.bone, None)
        self._found[stage.bone] = TrackState.at_rest(pose, captured_ns, verdict.cause)

    def forget(self, bone: str) -> None:
        """A bone is followed no longer."""
        self._tracks.pop(bone, None)
        self._found.pop(bone, None)

    def offer(self, registration: Registration) -> None:
        """Put the answers of a registration under review: all but the lost ones.

        Where refused poses are followed, those that are lost too, so that they can be measured.
        """
        self.drop_candidates()
        self._n_reviewed += 1
        found = [
            (answer, answer.left_from_bone)
            for answer in registration.answers
            if answer.verdict.status is not Status.LOST or self._trackers.follows_refused
        ]
        self._candidates = [
            Candidate(
                TrackState.at_rest(pose, registration.captured_ns, answer.verdict.cause),
                answer,
                False,
                number,
                len(found),
            )
            for number, (answer, pose) in enumerate(found, start=1)
            if pose is not None
        ]

    def propose(self, bone: str, pose: RigidTransform, now_ns: int) -> None:
        """Put a pose under review that will be judged as it stands."""
        self.drop_candidates()
        self._n_reviewed += 1
        track = TrackState.at_rest(pose, now_ns)
        self._candidates = [Candidate(track, _make_unjudged(bone), is_held=True)]

    def drop_candidates(self) -> None:
        """Forget the candidates; accepted tracks stay."""
        self._candidates = []
        self.track_number += 1

    def forget_verdicts(self) -> None:
        """The candidates must be judged anew before one can be accepted."""
        self._candidates = [
            replace(candidate, tracked=_make_unjudged(candidate.tracked.bone))
            for candidate in self._candidates
        ]

    def accept(self, stage: StageSpec) -> None:
        """The candidate is the bone's pose from now on."""
        self._tracks[stage.bone] = self._candidates[0].track
        self._found.pop(stage.bone, None)
        self._candidates = []

    def reject(self) -> Candidate:
        """Take the candidate out; the next one, if any, comes under review."""
        self.track_number += 1
        self._n_reviewed += 1
        return self._candidates.pop(0)

    def choose(self, step: int) -> Candidate:
        """The next candidate by its number comes under review, or with -1 the one before.

        The others keep their order and the poses that they were last seen at.
        """
        by_number = self.candidates
        place = by_number.index(self._candidates[0]) + step
        chosen = by_number[place % len(by_number)]
        self._candidates = [chosen, *(one for one in by_number if one is not chosen)]
        self.track_number += 1
        self._n_reviewed += 1
        return chosen

    def review(self, stage: StageSpec, frame: StereoFrame) -> TrackedFrame:
        """Follow the candidate into a frame, or judge a proposed pose where it stands."""
        candidate = self._candidates[0]
        tracker, goal = self._trackers.tracker(stage.bone), self._trackers.goal(stage)
        track = candidate.track
        if candidate.is_held:
            tracked = tracker.assess(frame, track.left_from_bone, goal)
        else:
            tracked, track = tracker.track(frame, track, goal)
        self._candidates[0] = replace(candidate, tracked=tracked, track=track)
        return tracked

    def follow(self, stage: StageSpec, frame: StereoFrame) -> TrackedFrame:
        """Follow the accepted bone into a frame."""
        tracker, goal = self._trackers.tracker(stage.bone), self._trackers.goal(stage)
        track = self._tracks[stage.bone]
        tracked, self._tracks[stage.bone] = tracker.track(frame, track, goal)
        return tracked

    def predict(self, stage: StageSpec, time_ns: int) -> RigidTransform | None:
        """Where the accepted bone will be at a moment, by its motion.

        Where it was measured, when it was lost before or is in doubt; None when a corner of its box
        moves further than `FARTHEST_PREDICTED_MM` until then: nobody knows where it will be.
        """
        track = self._tracks.get(stage.bone)
        if track is None:
            return None
        if track.n_lost > 0 or track.n_doubted > 0:
            return track.left_from_bone
        corners_mm = self._trackers.corners_mm(stage.bone)
        pose = track.predict(time_ns, corners_mm.mean(axis=0))
        moved = pose.apply(corners_mm) - track.left_from_bone.apply(corners_mm)
        return pose if np.linalg.norm(moved, axis=1).max() <= FARTHEST_PREDICTED_MM else None

    def glance(
        self, stage: StageSpec, frame: StereoFrame, moved: RigidTransform | None, tracker: Tracker
    ) -> TrackedFrame:
        """Follow an accepted or found bone into a frame if it is near where it is expected.

        Args:
            stage: whose bone, and by whose goal.
            frame: the next one.
            moved: in the left camera, how something that the bone goes with has moved meanwhile.
            tracker: of the bone in that frame.
        """
        goal = self._trackers.goal(stage)
        tracks = self._tracks if self.is_accepted(stage) else self._found
        track = tracks[stage.bone]
        if moved is not None:
            track = track.carry(moved)
        tracked, tracks[stage.bone] = tracker.glance(frame, track, goal)
        return tracked

    def register_now(self, stage: StageSpec, frame: StereoFrame) -> TrackedFrame:
        """Register a bone without a review: the best answer, if not lost, is its pose from now on.

        For replays, where nobody is there to be asked.
        """
        answers = self._trackers.register(stage, frame)
        best = answers[0] if answers else _make_unjudged(stage.bone)
        pose, verdict = best.left_from_bone, best.verdict
        if pose is not None and verdict.status is not Status.LOST:
            track = TrackState.at_rest(pose, frame.captured_ns, verdict.cause)
            self._tracks[stage.bone] = track
        return best


def _make_unjudged(bone: str) -> TrackedFrame:
    """Of a pose that no frame has judged: it counts as lost and cannot be accepted."""
    return TrackedFrame(bone, None, Verdict(Status.LOST), FrameTimings())
