"""A clock that runs faster than real time, to shorten warm-up times."""

from drivers.clock import SystemClock


class FastClock:
    """The system's clock, so many times as fast from now on.

    Raises:
        ValueError: not faster than standing still.
    """

    def __init__(self, speed: float) -> None:
        if not speed > 0.0:
            raise ValueError("the speed of a clock must be positive")
        self._speed = speed
        self._real = SystemClock()
        self._begin_ns = self._real.now_ns()

    def now_ns(self) -> int:
        """Now."""
        elapsed_ns = self._real.now_ns() - self._begin_ns
        return self._begin_ns + round(elapsed_ns * self._speed)

    def wait_until_ns(self, moment_ns: int) -> None:
        """Sleep until that moment."""
        elapsed_ns = (moment_ns - self._begin_ns) / self._speed
        self._real.wait_until_ns(self._begin_ns + round(elapsed_ns))
