"""Steps a capture in a thread of its own; `snapshot` and `submit` never block."""

import threading

from navapp.control.capture.capture import Capture
from navapp.control.capture.states import CaptureCommand, CapturePhase, CaptureSnapshot


class CaptureRunner:
    """A running capture.

    Attributes:
        error: what ended it, or None.
    """

    def __init__(self, capture: Capture) -> None:
        self._capture = capture
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="capture", daemon=True)
        self.error: Exception | None = None

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def snapshot(self) -> CaptureSnapshot:
        """The newest one."""
        return self._capture.snapshot

    @property
    def is_over(self) -> bool:
        """It was left, or an error ended it."""
        return self.error is not None or self.snapshot().phase is CapturePhase.OVER

    def submit(self, command: CaptureCommand) -> None:
        """Hand a command over."""
        self._capture.submit(command)

    def stop(self) -> None:
        """End the loop; safe to call twice. The capture itself is closed by who made it."""
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join(10.0)

    def _run(self) -> None:
        try:
            while not self._stopping.is_set() and not self.is_over:
                self._capture.step()
        except Exception as error:  # noqa: BLE001 (kept for the caller, which reports it)
            self.error = error
