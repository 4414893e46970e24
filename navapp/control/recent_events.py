"""The sentences that a guided session told last."""

from collections import deque
from typing import Protocol

_MOST = 30


class RecentEvents:
    """Keeps the last sentences, and counts all.

    Attributes:
        n_told: how many there were ever.
    """

    def __init__(self) -> None:
        self._texts: deque[str] = deque(maxlen=_MOST)
        self.n_told = 0

    @property
    def texts(self) -> tuple[str, ...]:
        """The last ones, newest last."""
        return tuple(self._texts)

    def add(self, text: str) -> None:
        """Tell one."""
        self._texts.append(text)
        self.n_told += 1


class TellsEvents(Protocol):
    """A snapshot of such a session."""

    @property
    def events(self) -> tuple[str, ...]:
        """The last sentences, newest last."""
        ...

    @property
    def n_events(self) -> int:
        """How many there were ever."""
        ...


def list_new_events(snapshot: TellsEvents, n_known: int) -> tuple[str, ...]:
    """Those of the last sentences that were told after the first `n_known` of all."""
    n_new = min(snapshot.n_events - n_known, len(snapshot.events))
    return snapshot.events[len(snapshot.events) - n_new :]
