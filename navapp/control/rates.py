"""How fast frames are handled, for the screen."""

import time
from collections import deque

import numpy as np

from navapp.control.states import CaptureToLight, Rates

# Frames over which figures are told; a spread is told of so many at least.
_WINDOW, _FEWEST = 40, 10


class RateMeter:
    """Counts handled frames in real time.

    Args:
        delay_ms: from handing a picture to the display until its light; 0: not known.
        delay_bound_ms: 95 % bound of that delay's error; 0: not known.
    """

    def __init__(self, delay_ms: float = 0.0, delay_bound_ms: float = 0.0) -> None:
        self._delay_ms, self._delay_bound_ms = delay_ms, delay_bound_ms
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
            light=self._light(),
            n_frames=self._n_frames,
            n_dropped=n_dropped,
            skew_ms=self._skew_ms,
        )

    def _light(self) -> CaptureToLight | None:
        if min(self._delay_ms, self._delay_bound_ms) <= 0.0 or len(self._latency_ms) < _FEWEST:
            return None
        latency_ms = np.array(self._latency_ms)
        off_ms = np.quantile(np.abs(latency_ms - latency_ms.mean()), 0.95)
        return CaptureToLight(
            float(latency_ms.mean()) + self._delay_ms, float(np.hypot(off_ms, self._delay_bound_ms))
        )
