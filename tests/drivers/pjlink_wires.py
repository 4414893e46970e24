"""A PJLink connection without a network: the driver at one end, simulated firmware at the other."""

from collections.abc import Callable

from drivers.clock import ManualClock
from drivers.pjlink_projector import PjlinkProjector
from sim_devices.firmware import pjlink


class Wire:
    """One connection; `spoil` turns every reply into what arrives of it.

    None: nothing, and what is waited for in vain takes its time; empty: the end of the stream.
    """

    def __init__(
        self, firmware: pjlink.PjlinkProjector, spoil: Callable[[bytes], bytes | None]
    ) -> None:
        self.clock = firmware.clock
        self.session = firmware.connection()
        self.spoil = spoil
        self.sent = b""
        self.arriving = spoil(self.session.greeting())

    def send(self, data: bytes) -> None:
        self.sent += data
        self.arriving = self.spoil(self.session.receive(data))

    def receive(self, timeout_s: float) -> bytes:
        assert timeout_s > 0.0
        if self.arriving is None:
            self.clock.wait_until_ns(self.clock.now_ns() + round(timeout_s * 1e9))
            raise TimeoutError
        data, self.arriving = self.arriving, None
        return data

    def close(self) -> None:
        pass


def driver(
    firmware: pjlink.PjlinkProjector,
    spoil: Callable[[bytes], bytes | None] = bytes,
    password: str = "",
) -> PjlinkProjector:
    """A driver that is not open, on the firmware's clock."""
    clock = firmware.clock
    assert isinstance(clock, ManualClock)
    return PjlinkProjector("test", clock, lambda _: Wire(firmware, spoil), password)
