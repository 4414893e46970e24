"""Where a first registration runs: at once, in a worker, or as a recording says."""

import threading
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

T = TypeVar("T")


class Job(Generic[T]):
    """Work that was handed over; polled by the controller."""

    def __init__(self, work: Callable[[Callable[[float], None]], T]) -> None:
        self._work = work
        self.progress = 0.0
        self.result: T | None = None
        self.error: Exception | None = None
        self._cancelled = threading.Event()
        self._finished = threading.Event()

    def run(self) -> None:
        """Do the work; called once."""
        try:
            self.result = self._work(self._report)
        except Exception as error:  # noqa: BLE001 (handed to the controller, which reports it)
            self.error = error
        self._finished.set()

    def cancel(self) -> None:
        """Ask it to stop at its next report."""
        self._cancelled.set()

    @property
    def is_cancelled(self) -> bool:
        """It was asked to stop."""
        return self._cancelled.is_set()

    @property
    def is_finished(self) -> bool:
        """`result` or `error` is set."""
        return self._finished.is_set()

    def _report(self, share: float) -> None:
        self.progress = share
        if self._cancelled.is_set():
            raise JobCancelled


class JobCancelled(Exception):  # noqa: N818 (asked for)
    """The job was asked to stop."""


class Executor(Protocol):
    """Starts jobs and says when their results may be used."""

    def start(self, job: Job[T]) -> None:
        """Begin."""
        ...

    def take_due(self, job: Job[T], sequence: int) -> bool:
        """Whether the result may be taken over after that frame."""
        ...

    def close(self) -> None:
        """Wait for what still runs."""
        ...


class InlineExecutor:
    """Runs a job at once: deterministic, for stepped sources."""

    def start(self, job: Job[T]) -> None:
        """Run it to its end."""
        job.run()

    def take_due(self, job: Job[T], sequence: int) -> bool:
        """Always."""
        return job.is_finished

    def close(self) -> None:
        """Nothing runs."""


class ThreadExecutor:
    """Runs a job in a worker thread: the loop never waits for it.

    Args:
        name: of the thread.
    """

    def __init__(self, name: str = "registration") -> None:
        self._name = name
        self._threads: list[threading.Thread] = []

    def start(self, job: Job[T]) -> None:
        """Begin in the background."""
        thread = threading.Thread(target=job.run, name=self._name, daemon=True)
        self._threads = [other for other in self._threads if other.is_alive()] + [thread]
        thread.start()

    def take_due(self, job: Job[T], sequence: int) -> bool:
        """When it has finished."""
        return job.is_finished

    def close(self) -> None:
        """Wait for the workers; they were cancelled before."""
        for thread in self._threads:
            thread.join(10.0)


class RecordedExecutor:
    """Runs a job at once but hands its result over when the recorded session did."""

    def __init__(self, taken_over_after: list[int]) -> None:
        self._due = list(taken_over_after)

    def start(self, job: Job[T]) -> None:
        """Run it to its end."""
        job.run()

    def take_due(self, job: Job[T], sequence: int) -> bool:
        """After the frame that the recording names; never when it names none.

        A job that was cancelled before it ended was not taken over, and must not be here.
        """
        if not self._due or sequence < self._due[0]:
            return False
        self._due.pop(0)
        return job.is_finished

    def close(self) -> None:
        """Nothing runs."""
