"""Tasks in their order, ticked by what snapshots of a session show."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

SnapshotT = TypeVar("SnapshotT")


@dataclass(frozen=True, slots=True)
class Task(Generic[SnapshotT]):
    """One thing to do."""

    text: str  # what to do now, and what is seen then
    reached: str  # what has been reached with it
    is_reached: Callable[[SnapshotT], bool]  # by a snapshot of the session


class Guide(Generic[SnapshotT]):
    """Where somebody stands in a list of tasks; a task that was reached stays so.

    Args:
        tasks: in their order.
        ending: what to do once all are reached.
    """

    def __init__(self, tasks: Sequence[Task[SnapshotT]], ending: str) -> None:
        self._tasks, self._ending = tuple(tasks), ending
        self._n_reached = 0

    @property
    def n_tasks(self) -> int:
        """Of the whole list."""
        return len(self._tasks)

    @property
    def n_reached(self) -> int:
        """So far."""
        return self._n_reached

    @property
    def is_complete(self) -> bool:
        """All tasks were reached."""
        return self._n_reached == len(self._tasks)

    @property
    def now(self) -> str:
        """What to do now."""
        return self._ending if self.is_complete else self._tasks[self._n_reached].text

    @property
    def last_reached(self) -> str:
        """What was reached last; empty before the first."""
        return "" if self._n_reached == 0 else self._tasks[self._n_reached - 1].reached

    def observe(self, snapshot: SnapshotT) -> None:
        """Tick what a snapshot shows to be reached, one task after the other."""
        while not self.is_complete and self._tasks[self._n_reached].is_reached(snapshot):
            self._n_reached += 1
