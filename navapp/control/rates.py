"""How fast frames are handled, for the screen."""

import time
from collections import deque

from navapp.control.states import Rates

_WINDOW = 40


class RateMeter:
    """Counts handled frames in real time."""

    def __init__(self) -> None:
        self._moments_ns: deque[int] = deque(maxlen=_WINDOW)
        self._fps: deque[float] = deque(maxlen=_WINDOW)
        self._latency_ms: deque[float] = deque(maxlen=_WINDOW)
        self._skew_ms: float | None = None
        self._n_frames = 0

    def add(self, latency_ms: float | None, skew_ns: int) -> None:
        """One more frame is done.

        Args:
            latency_ms: from its capture until its picture was handed to the display; None of a
                frame that waited to be read.
            skew_ns: between the two cameras.
        """
        self._moments_ns.append(time.perf_counter_ns())
        if latency_ms is not None:
            self._latency_ms.append(latency_ms)
        self._skew_ms = skew_ns / 1e6
        self._n_frames += 1
        span_ns = self._moments_ns[-1] - self._moments_ns[0]
        if len(self._moments_ns) > 1 and span_ns > 0:
            self._fps.append((len(self._moments_ns) - 1) * 1e9 / span_ns)

    def rates(self, n_dropped: int) -> Rates:
        """As of the newest frame."""
        return Rates(
            frames_per_s=self._fps[-1] if self._fps else None,
            latency_ms=self._latency_ms[-1] if self._latency_ms else None,
            fps_history=tuple(self._fps),
            latency_history_ms=tuple(self._latency_ms),
            n_frames=self._n_frames,
            n_dropped=n_dropped,
            skew_ms=self._skew_ms,
        )
