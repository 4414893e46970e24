"""Clocks: monotonic nanoseconds of the host, or of a clock that a test sets."""

import threading
import time
from typing import Protocol


class Clock(Protocol):
    """Monotonic time in integer nanoseconds."""

    def now_ns(self) -> int:
        """Now."""
        ...

    def wait_until_ns(self, moment_ns: int) -> None:
        """Return at or after that moment."""
        ...


class SystemClock:
    """The host's monotonic clock: the base of V4L2's and DepthAI's time stamps."""

    def now_ns(self) -> int:
        """`CLOCK_MONOTONIC`."""
        return time.monotonic_ns()

    def wait_until_ns(self, moment_ns: int) -> None:
        """Sleep, again when woken too early."""
        while (remaining_ns := moment_ns - self.now_ns()) > 0:
            time.sleep(remaining_ns / 1e9)


class ManualClock:
    """A clock that stands until it is moved; waiting moves it. Never runs backwards."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns
        self._lock = threading.Lock()

    def now_ns(self) -> int:
        """The moment it was moved to."""
        with self._lock:
            return self._now_ns

    def advance_ns(self, duration_ns: int) -> None:
        """Move forwards by a duration."""
        if duration_ns < 0:
            raise ValueError("a clock cannot run backwards")
        with self._lock:
            self._now_ns += duration_ns

    def wait_until_ns(self, moment_ns: int) -> None:
        """Move forwards to a moment; nothing happens when it has passed."""
        with self._lock:
            self._now_ns = max(self._now_ns, moment_ns)
