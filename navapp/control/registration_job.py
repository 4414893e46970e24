"""The first registration that runs, if one does."""

from dataclasses import dataclass

from drivers.frames import StereoFrame
from navapp.control.executors import Executor, Job
from navapp.control.trackers import Trackers
from navapp.values import Prior, StageSpec, TrackedFrame
from navapp.values.progress import Progress


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """What a first registration has found."""

    answers: list[TrackedFrame]  # best first, lost ones among them; empty when no start was known
    captured_ns: int  # of the frame that was searched


class RegistrationJob:
    """Runs one first registration at a time; started and asked from the loop alone.

    Args:
        trackers: do the search.
        executor: runs it, in a worker thread or at once.
    """

    def __init__(self, trackers: Trackers, executor: Executor) -> None:
        self._trackers = trackers
        self._executor = executor
        self._job: Job[Registration] | None = None

    @property
    def progress(self) -> float | None:
        """Share done; None when none runs."""
        return None if self._job is None else self._job.progress

    def set_start(self, bone: str, start: Prior) -> None:
        """From now on a bone is searched for where an operator has said that it is."""
        self._trackers.set_start(bone, start)

    def start_of(self, bone: str) -> Prior:
        """Where a bone is searched for."""
        return self._trackers.start(bone)

    def start(self, stage: StageSpec, frame: StereoFrame) -> bool:
        """Search for a stage's bone in a frame, unless a search runs; whether it was started."""
        if self._job is not None:
            return False

        def search(on_progress: Progress) -> Registration:
            answers = self._trackers.register(stage, frame, on_progress)
            return Registration(answers, frame.captured_ns)

        self._job = Job(search)
        self._executor.start(self._job)
        return True

    def take_due(self, next_sequence: int) -> Registration | None:
        """The result, once, when it may be used from that frame on; None while there is none.

        What the search has raised is raised here.
        """
        job = self._job
        if job is None or not self._executor.take_due(job, next_sequence):
            return None
        self._job = None
        if job.error is not None:
            raise job.error
        return job.result

    def cancel(self) -> None:
        """Stop the search, if one runs; its result is never used."""
        if self._job is not None:
            self._job.cancel()
            self._job = None
