"""A session with a projector over the network: every fault is told, and dark in time."""

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial

import pytest

from drivers.clock import SystemClock
from drivers.pjlink_line import TcpConnection
from drivers.pjlink_projector import PjlinkProjector
from navapp.control.states import DeviceHealth, EventLevel
from navapp.values import Reason
from sim_devices.firmware import pjlink
from sim_devices.firmware.fast_clock import FastClock
from sim_devices.firmware.pjlink_server import PjlinkServer
from tests.control.fakes import Bench, navigating

pytestmark = pytest.mark.waits


class Room:
    """A session, its projector, and the socket between."""

    def __init__(self, stack: ExitStack) -> None:
        self.firmware = pjlink.PjlinkProjector(FastClock(200.0))
        self.server = PjlinkServer(self.firmware)
        self.server.start()
        stack.callback(lambda: self.server.close())
        connect = partial(TcpConnection, "127.0.0.1", self.server.port)
        projector = PjlinkProjector("127.0.0.1", SystemClock(), connect)
        projector.open()
        projector.set_power(True, 20.0)
        self.bench = Bench(projector=projector)
        stack.callback(self.bench.controller.close)

    def unplug(self) -> None:
        self.server.close()

    def plug(self) -> None:
        self.server = PjlinkServer(self.firmware, port=self.server.port)
        self.server.start()

    def is_dark_because(self, reason: Reason) -> bool:
        return self.bench.is_dark and reason in self.bench.snapshot.reasons


@pytest.fixture
def room(monkeypatch) -> Iterator[Room]:
    monkeypatch.setattr("navapp.control.device_monitor.PROJECTOR_TIMES_S", (0.2, 20.0))
    with ExitStack() as stack:
        made = Room(stack)
        navigating(made.bench)
        made.bench.until(lambda: made.bench.shows_guides, 5.0)
        yield made


FAULTS: dict[str, tuple[Callable[[Room], object], Callable[[Room], object], Reason, str]] = {
    "unplugged": (
        Room.unplug,
        Room.plug,
        Reason.PROJECTOR_LOST,
        # A question may be on its way when the plug is pulled.
        "no projector answers at|it has hung up",
    ),
    "without mains": (
        lambda room: setattr(room.firmware, "is_powered", False),
        lambda room: setattr(room.firmware, "is_powered", True),
        Reason.PROJECTOR_LOST,
        "it has hung up",
    ),
    "on a line that cuts everything": (
        lambda room: setattr(room.server.trouble, "cut", 1.0),
        lambda room: setattr(room.server.trouble, "cut", 0.0),
        Reason.PROJECTOR_LOST,
        "it has hung up",
    ),
    "failed": (
        lambda room: setattr(room.firmware, "is_failed", True),
        lambda room: setattr(room.firmware, "is_failed", False),
        Reason.PROJECTOR_LOST,
        "fault",
    ),
    "swapped": (
        lambda room: setattr(room.firmware, "name", "OTHER"),
        lambda room: setattr(room.firmware, "name", "sim:projector"),
        Reason.PROJECTOR_LOST,
        "calls itself 'OTHER'",
    ),
    "of another source": (
        lambda room: room.firmware.answer("INPT", "32"),
        lambda room: room.firmware.answer("INPT", "31"),
        Reason.PROJECTOR_ALTERS,
        "of another source",
    ),
}


@pytest.mark.parametrize(("deed", "repair", "reason", "words"), FAULTS.values(), ids=FAULTS)
def test_a_fault_is_told_and_dark_in_time_and_passes(room, deed, repair, reason, words) -> None:
    bench = room.bench
    deed(room)
    bench.until(lambda: room.is_dark_because(reason), 5.0)
    assert bench.state == "navigating"
    assert re.search(words, bench.line("projector").detail)
    alarm = next(event for event in reversed(bench.events) if event.level is EventLevel.ALARM)
    assert f"dark: {reason.value}" in alarm.text
    assert re.search(words, alarm.text)
    bench.frames(3)
    assert bench.is_dark
    repair(room)
    bench.until(lambda: bench.shows_guides, 10.0)
    assert bench.line("projector").health is DeviceHealth.OK


def test_a_lamp_that_goes_out_is_told(room) -> None:
    room.firmware.answer("POWR", "0")
    room.bench.until(lambda: room.bench.line("projector").detail == "standby", 5.0)
    assert room.bench.line("projector").health is DeviceHealth.TROUBLE
