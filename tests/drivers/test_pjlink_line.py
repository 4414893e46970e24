"""How the end of a connection is told."""

import pytest

from drivers.clock import ManualClock
from drivers.pjlink_line import PjlinkLine
from navapp.errors import DeviceLost


class Ending:
    """A connection that greets, and ends when it is asked something."""

    def __init__(self, on_send: OSError | None, on_receive: OSError | None) -> None:
        self._on_send, self._on_receive = on_send, on_receive
        self._greeting = b"PJLINK 0\r"

    def send(self, data: bytes) -> None:
        if self._on_send:
            raise self._on_send

    def receive(self, timeout_s: float) -> bytes:
        data, self._greeting = self._greeting, b""
        if not data and self._on_receive:
            raise self._on_receive
        return data

    def close(self) -> None:
        pass


@pytest.mark.parametrize(
    ("on_send", "on_receive", "why"),
    [
        (None, None, "it has hung up"),
        (None, ConnectionResetError(104, "Connection reset by peer"), "it has hung up"),
        (BrokenPipeError(32, "Broken pipe"), None, "it has hung up"),
        (None, OSError(113, "No route to host"), "No route to host"),
    ],
)
def test_how_a_connection_ends_is_told_in_the_same_words(on_send, on_receive, why) -> None:
    line = PjlinkLine(lambda _: Ending(on_send, on_receive), "", ManualClock(1), 10**10)
    with pytest.raises(DeviceLost, match=why):
        line.ask("POWR")
