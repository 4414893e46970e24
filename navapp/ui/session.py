"""The interface of a session that the screen uses."""

from typing import Protocol

from navapp.control.commands import Command
from navapp.control.states import Snapshot


class Session(Protocol):
    """A running session as its clients see it. No call blocks."""

    def snapshot(self) -> Snapshot:
        """The newest snapshot."""
        ...

    def submit(self, command: Command) -> None:
        """Hand over a command; what became of it is in a later snapshot."""
        ...

    def stop(self) -> None:
        """End the session's thread and darken the display; may be called twice."""
        ...
