"""A first registration in the making, and the candidates that it left for review."""

from dataclasses import dataclass

from drivers.frames import StereoFrame
from navapp.control.executors import Executor, Job
from navapp.geometry.transform import RigidTransform
from navapp.tracking import Line, TrackState
from navapp.tracking.line import Goal
from navapp.values import Prior, Status, TrackedFrame


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A pose under review.

    Attributes:
        track: where it is now.
        tracked: the line's newest answer for it.
        is_held: judged as it stands (proposed by hand), not followed.
        number, count: the n-th of how many.
    """

    track: TrackState
    tracked: TrackedFrame
    is_held: bool = False
    number: int = 1
    count: int = 1


class Registration:
    """One first registration of one bone, from the frame that it was started with."""

    def __init__(
        self, line: Line, frame: StereoFrame, prior: Prior, goal: Goal, executor: Executor
    ) -> None:
        self._frame = frame
        self._executor = executor
        self._job: Job[list[TrackedFrame]] = Job(
            lambda report: line.register(frame.left, frame.right, prior, goal, report)
        )
        executor.start(self._job)

    @property
    def progress(self) -> float:
        """Share done."""
        return self._job.progress

    @property
    def error(self) -> Exception | None:
        """What went wrong, once it is over."""
        return self._job.error

    def cancel(self) -> None:
        """Ask it to stop."""
        self._job.cancel()

    def is_due(self, next_sequence: int) -> bool:
        """Whether it is over and may be taken over before that frame."""
        return self._executor.is_due(self._job, next_sequence)

    def candidates(self) -> list[Candidate]:
        """Answers that are not lost, best first."""
        found = [
            (tracked, tracked.left_from_bone)
            for tracked in self._job.result or []
            if tracked.verdict.status is not Status.LOST
        ]
        poses: list[tuple[TrackedFrame, RigidTransform]] = [
            (tracked, pose) for tracked, pose in found if pose is not None
        ]
        return [
            Candidate(
                TrackState.at_rest(pose, self._frame.captured_ns),
                tracked,
                number=number,
                count=len(poses),
            )
            for number, (tracked, pose) in enumerate(poses, start=1)
        ]

    def failure(self) -> TrackedFrame | None:
        """The best answer when all are lost."""
        return self._job.result[0] if self._job.result else None
