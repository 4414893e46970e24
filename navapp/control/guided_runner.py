"""Steps a guided calibration in a thread of its own; `snapshot` and `submit` never block."""

import threading
from typing import Generic, Protocol, TypeVar


class Ending(Protocol):
    """A snapshot that says whether it is the last one."""

    @property
    def is_over(self) -> bool:
        """Nothing more will come."""
        ...


SnapshotT = TypeVar("SnapshotT", bound=Ending)
CommandT = TypeVar("CommandT")
CommandT_contra = TypeVar("CommandT_contra", contravariant=True)


class Stepped(Protocol[SnapshotT, CommandT_contra]):
    """What is stepped: a capture, or the alignment of crosses."""

    snapshot: SnapshotT

    def submit(self, command: CommandT_contra) -> None:
        """Hand a command over; called from any thread."""
        ...

    def step(self) -> SnapshotT:
        """Take a frame and do what is due."""
        ...


class GuidedRunner(Generic[SnapshotT, CommandT]):
    """A running guided calibration.

    Attributes:
        error: what ended it, or None.
    """

    def __init__(self, session: Stepped[SnapshotT, CommandT], name: str) -> None:
        self._session = session
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self.error: Exception | None = None

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def snapshot(self) -> SnapshotT:
        """The newest one."""
        return self._session.snapshot

    @property
    def is_over(self) -> bool:
        """It was left, or an error ended it."""
        return self.error is not None or self.snapshot().is_over

    def submit(self, command: CommandT) -> None:
        """Hand a command over."""
        self._session.submit(command)

    def stop(self) -> None:
        """End the loop; safe to call twice. What was stepped is closed by who made it."""
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join(10.0)

    def _run(self) -> None:
        try:
            while not self._stopping.is_set() and not self.is_over:
                self._session.step()
        except Exception as error:  # noqa: BLE001 (kept for the caller, which reports it)
            self.error = error
