"""A projector that speaks ESC/VP21 on a network: ESC/VP.net's greeting, then the same."""

from sim_devices.firmware.escvp21 import ProjectorFirmware


class NetworkedProjectorFirmware:
    """The same projector behind its network port: a greeting of 16 bytes comes first."""

    def __init__(self, inner: ProjectorFirmware, *, wants_password: bool = False) -> None:
        self._inner = inner
        self._status = 0x41 if wants_password else 0x20
        self._greeting = bytearray()
        self._out: list[bytes] = []

    def receive(self, data: bytes) -> None:
        """Sixteen bytes of greeting, then commands."""
        missing = 16 - len(self._greeting)
        self._greeting += data[:missing]
        if missing and len(self._greeting) == 16 and self._greeting.startswith(b"ESC/VP.net"):
            self._out.append(b"ESC/VP.net\x10\x03\x00\x00" + bytes((self._status, 0)))
        if data[missing:] and self._status == 0x20:
            self._inner.receive(data[missing:])

    def messages(self) -> list[bytes]:
        """What was sent."""
        out, self._out = self._out, []
        return [*out, *self._inner.messages()]

    def next_ns(self) -> int | None:
        """When the lamp changes."""
        return self._inner.next_ns()
