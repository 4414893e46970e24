"""When a grabbed picture was exposed, on the host's monotonic clock."""

# A stamp within this of the host's time is taken as one of the host's clock: a clock of the
# camera's own begins at any number, and a queue of pictures does not grow so old.
_SAME_CLOCK_NS = 10_000_000_000


class CaptureTimes:
    """Turns a driver's stamps into capture times; without usable stamps, the time of the grab.

    Whether the stamps are of the host's clock is decided by the first one.

    Attributes:
        has_stamps: the driver's clock is used; None before the first picture.
    """

    def __init__(self) -> None:
        self.has_stamps: bool | None = None
        self._last_ns: int | None = None

    def of(
        self, stamp_ms: float, before_ns: int, after_ns: int, exposure_ms: float = 0.0
    ) -> int | None:
        """Mid exposure of a picture in ns; None when it is not a new one, or not possible.

        Args:
            stamp_ms: the driver's, of the start of exposure; 0 when it has none.
            before_ns: before the grab was called.
            after_ns: when it returned.
            exposure_ms: how long the picture was exposed, 0 when that is not known.
        """
        stamp_ns = round(stamp_ms * 1e6)
        if self.has_stamps is None:
            self.has_stamps = stamp_ns > 0 and abs(after_ns - stamp_ns) < _SAME_CLOCK_NS
        if not self.has_stamps:
            captured_ns = (before_ns + after_ns) // 2
        elif stamp_ns > after_ns:
            return None
        else:
            captured_ns = min(stamp_ns + round(exposure_ms * 0.5e6), after_ns)
        if self._last_ns is not None and captured_ns <= self._last_ns:
            return None
        self._last_ns = captured_ns
        return captured_ns
