"""Shows a code on a display and remembers when it did."""

import threading

import numpy as np

from calibration.latency.light_code import Switches
from drivers.clock import Clock
from drivers.interfaces import Display
from navapp.geometry.transform import FloatArray

_WHITE = 255
# Dark before the first switch, so that frames see what darkness is.
_LEAD_NS = 500_000_000
# Longer than any pause: what stands still turns dark by itself.
_VALID_NS = 300_000_000


class CodePlayer:
    """Makes a display light and dark in turn; used from one thread at a time.

    Attributes:
        called_ns: when it was told to change, so far.
    """

    def __init__(self, display: Display, clock: Clock, pauses_ms: FloatArray) -> None:
        """Set up; nothing is shown before `begin`.

        Args:
            display: opened.
            clock: of the display, and of the camera's stamps.
            pauses_ms: (n,) between the switches.
        """
        size = (display.info.height, display.info.width, 3)
        self._pictures = [np.zeros(size, np.uint8), np.full(size, _WHITE, np.uint8)]
        self._display, self._clock = display, clock
        self._pauses_ns = [round(pause * 1e6) for pause in pauses_ms]
        self._next_ns = 0
        self._stopping = threading.Event()
        self.called_ns: list[int] = []

    @property
    def n_switches(self) -> int:
        """Of the whole code."""
        return len(self._pauses_ns) + 1

    @property
    def is_over(self) -> bool:
        """All switches were made."""
        return len(self.called_ns) == self.n_switches

    @property
    def switches(self) -> Switches:
        """That were made, ms since the first one."""
        times_ns = np.array(self.called_ns, dtype=np.int64)
        return Switches((times_ns - times_ns[0]) * 1e-6)

    def begin(self) -> None:
        """Dark; the first switch comes a little later."""
        self.darken()
        self._next_ns = self._clock.now_ns() + _LEAD_NS

    def play(self, until_ns: int | None = None) -> None:
        """Make the switches that are due by then, each at its time; without a limit all of them.

        Raises:
            DeviceLost: the display is gone.
        """
        while not (self.is_over or self._stopping.is_set()):
            if until_ns is not None and self._next_ns > until_ns:
                return
            self._clock.wait_until_ns(self._next_ns)
            self._switch()

    def darken(self) -> None:
        """Black, now."""
        self._display.blank()

    def stop(self) -> None:
        """No further switch, from any thread."""
        self._stopping.set()

    def _switch(self) -> None:
        n = len(self.called_ns)
        now_ns = self._clock.now_ns()
        self._display.show(self._pictures[(n + 1) % 2], now_ns + _VALID_NS)
        self.called_ns.append(now_ns)
        if n < len(self._pauses_ns):
            # From when it was done: a computer that is late makes the code longer, not denser.
            self._next_ns = now_ns + self._pauses_ns[n]
