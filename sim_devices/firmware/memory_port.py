"""A driver's port that is connected to a simulated wire."""

from dataclasses import dataclass

from drivers.clock import Clock
from navapp.errors import DeviceLost, DeviceNotFound
from sim_devices.firmware.wire import Wire

# A character at 9600 baud: bytes that come always take time.
_CHARACTER_NS = 1_041_667


@dataclass(frozen=True, slots=True)
class MemoryAddress:
    """Where the wire is plugged in."""

    wire: Wire
    name: str = "memory"
    is_simulated: bool = True

    def open(self) -> "MemoryPort":
        """A fresh port.

        Raises:
            DeviceNotFound: unplugged.
        """
        if not self.wire.is_connected:
            raise DeviceNotFound("nothing is plugged in", subject=self.name)
        return MemoryPort(self.wire)


class MemoryPort:
    """An open port."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._clock: Clock = wire.clock

    def read(self, timeout_s: float) -> bytes:
        """What has come within the time, which passes at once.

        Raises:
            DeviceLost: unplugged.
        """
        deadline_ns = self._clock.now_ns() + round(max(0.0, timeout_s) * 1e9)
        while not (data := self._wire.take_arrived()):
            self._require_plug()
            now_ns = self._clock.now_ns()
            if now_ns >= deadline_ns:
                return b""
            next_ns = self._wire.next_ns()
            moment_ns = deadline_ns if next_ns is None else min(deadline_ns, next_ns)
            # What is due but has nothing to say must not hold time still.
            self._clock.wait_until_ns(max(moment_ns, now_ns + 1))
        self._clock.wait_until_ns(self._clock.now_ns() + len(data) * _CHARACTER_NS)
        return data

    def write(self, data: bytes) -> None:
        """To the device.

        Raises:
            DeviceLost: unplugged.
        """
        self._require_plug()
        self._wire.receive(data)

    def close(self) -> None:
        """What is still under way is lost."""
        self._wire.take_arrived()

    def _require_plug(self) -> None:
        if not self._wire.is_connected:
            raise DeviceLost("the plug was pulled")
