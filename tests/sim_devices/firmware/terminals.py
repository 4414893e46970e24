"""A person at a firmware's terminal, on a clock that stands."""

from drivers.clock import ManualClock
from sim_devices.firmware.wire import Firmware


class Terminal:
    """Types commands and reads what comes."""

    def __init__(self, firmware: Firmware, clock: ManualClock) -> None:
        self.firmware = firmware
        self._clock = clock

    def type(self, command: bytes) -> bytes:
        self.firmware.receive(command)
        return b"".join(self.firmware.messages())

    def after_s(self, duration_s: float) -> bytes:
        self._clock.advance_ns(round(duration_s * 1e9))
        return b"".join(self.firmware.messages())
