"""A session with the real drivers on simulated firmware: every fault is told, and dark in time."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from navapp.control.commands import Reconnect
from navapp.control.executors import InlineExecutor
from navapp.control.states import DeviceHealth, EventLevel
from navapp.errors import DeviceError
from navapp.values import Reason
from sim_devices.firmware.pseudo_terminal import PseudoTerminal
from tests.control.fakes import Bench, navigating, wait_for
from tests.drivers.firmware_rigs import (
    mirror_at,
    projector_at,
    projector_terminal,
    stage_terminal,
)
from tests.many import few_of

pytestmark = pytest.mark.waits

# What is older than 1.5 s counts as lost (MIRROR_TIMES_S; on a clock that stands still:
# test_device_watch.py). The rest is for a machine that has other things to do.
MIRROR_DARK_S = 1.5 + 3.5


class Room:
    """A session with a mirror or a projector on a terminal."""

    def __init__(self, bench: Bench, terminal: PseudoTerminal) -> None:
        self.bench = bench
        self.terminal = terminal
        self.until, self.line = bench.until, bench.line

    def happens(self, deed: Callable[[object], object]) -> None:
        with self.terminal.held:
            deed(self.terminal.wire.firmware)

    def is_dark_because(self, reason: Reason) -> bool:
        return self.bench.is_dark and reason in self.bench.snapshot.reasons


@pytest.fixture
def with_mirror(tmp_path) -> Iterator[Room]:
    """Navigating with a mirror that was brought to its place."""
    with ExitStack() as stack:
        terminal = stack.enter_context(stage_terminal(tmp_path))
        mirror = mirror_at(terminal)
        mirror.open()
        bench = Bench(mirror=mirror)
        stack.callback(bench.controller.close)
        assert bench.is_dark
        assert Reason.MIRROR_AWAY in bench.snapshot.reasons
        room = Room(bench, terminal)
        room.until(lambda: room.line("mirror").health is DeviceHealth.OK, 10.0)
        assert room.line("mirror").detail == "45.0 deg"
        navigating(bench)
        room.until(lambda: bench.shows_guides, 2.0)
        yield room


MIRROR_FAULTS = {
    "turned by hand": (lambda stage: stage.turn_by_hand(1.0), "position unknown"),
    "pushed": (lambda stage: stage.push(1.0), "position unknown"),
    "without power": (lambda stage: stage.lose_power(), "does not answer"),
    "power failed shortly": (
        lambda stage: (stage.lose_power(), stage.restore_power()),
        "position unknown",
    ),
    "too hot": (lambda stage: stage.flags.add("FM"), "position unknown"),
}


@pytest.mark.parametrize(("deed", "words"), MIRROR_FAULTS.values(), ids=MIRROR_FAULTS)
def test_a_mirrors_fault_is_told_and_dark_in_time(with_mirror, deed, words) -> None:
    room = with_mirror
    room.happens(deed)
    room.until(lambda: room.is_dark_because(Reason.MIRROR_AWAY), MIRROR_DARK_S)
    assert room.bench.state == "navigating"
    room.until(lambda: words in room.line("mirror").detail, 2.0)
    assert room.line("mirror").health in (DeviceHealth.TROUBLE, DeviceHealth.LOST)
    alarm = next(e for e in reversed(room.bench.events) if e.level is EventLevel.ALARM)
    assert "dark: the mirror does not stand where the display was calibrated" in alarm.text
    room.bench.frames(5)
    assert room.bench.is_dark


def test_a_pulled_plug_is_dark_and_the_mirror_comes_back_by_itself(with_mirror) -> None:
    room = with_mirror
    room.terminal.unplug()
    room.until(lambda: room.is_dark_because(Reason.MIRROR_AWAY), MIRROR_DARK_S)
    assert room.line("mirror").health is DeviceHealth.LOST
    room.terminal.plug()
    room.until(lambda: room.bench.shows_guides, 10.0)
    assert room.line("mirror").detail == "45.0 deg"


def test_another_mount_in_its_place_stays_dark(with_mirror) -> None:
    room = with_mirror
    room.terminal.unplug()
    room.until(lambda: room.is_dark_because(Reason.MIRROR_AWAY), MIRROR_DARK_S)
    room.terminal.wire.firmware.model.serial = 7
    room.terminal.plug()
    room.bench.do(Reconnect())
    room.until(lambda: "serial number 7, the rig's is 990123" in room.line("mirror").detail, 5.0)
    assert room.is_dark_because(Reason.MIRROR_AWAY)


def test_the_operator_brings_a_turned_mirror_back(with_mirror) -> None:
    room = with_mirror
    room.happens(lambda stage: stage.turn_by_hand(1.0))
    room.until(lambda: room.is_dark_because(Reason.MIRROR_AWAY), MIRROR_DARK_S)
    room.bench.do(Reconnect())
    room.until(lambda: room.bench.shows_guides, 10.0)
    assert room.terminal.wire.firmware.true_deg == pytest.approx(45.0, abs=0.01)


def test_a_mirror_that_stalls_on_its_way_back_is_told_and_stays_dark(with_mirror) -> None:
    room = with_mirror
    room.happens(lambda stage: stage.turn_by_hand(5.0))
    room.until(lambda: room.is_dark_because(Reason.MIRROR_AWAY), MIRROR_DARK_S)
    room.happens(lambda stage: setattr(stage, "stalls_at", 0.5))
    room.bench.do(Reconnect())
    room.until(lambda: "stalled and stopped (FS)" in room.line("mirror").detail, 10.0)
    assert room.is_dark_because(Reason.MIRROR_AWAY)
    assert room.bench.state == "navigating"
    room.bench.do(Reconnect())
    room.until(lambda: room.bench.shows_guides, 10.0)


@pytest.fixture
def with_projector(monkeypatch, tmp_path) -> Iterator[Room]:
    """Navigating with a projector whose lamp is on."""
    monkeypatch.setattr("navapp.control.device_monitor.PROJECTOR_TIMES_S", (0.2, 20.0))
    with ExitStack() as stack:
        terminal = stack.enter_context(projector_terminal(tmp_path))
        projector = projector_at(terminal)
        projector.open()
        projector.set_power(True, 20.0)
        bench = Bench(projector=projector)
        stack.callback(bench.controller.close)
        room = Room(bench, terminal)
        navigating(bench)
        room.until(lambda: bench.shows_guides, 2.0)
        yield room


def setting(name: str, value: str) -> Callable[[object], None]:
    return lambda projector: projector.model.settings.__setitem__(name, value)


PROJECTOR_FAULTS = {
    "flipped": (setting("HREVERSE", "ON"), Reason.PROJECTOR_ALTERS, "flipped"),
    "swapped": (
        lambda projector: setattr(projector.model, "serial", "OTHER"),
        Reason.PROJECTOR_LOST,
        "serial number OTHER",
    ),
    "frozen": (setting("FREEZE", "ON"), Reason.PROJECTOR_ALTERS, "frozen"),
    "bent": (setting("VKEYSTONE", "130"), Reason.PROJECTOR_ALTERS, "another keystone"),
    "of another source": (setting("SOURCE", "A0"), Reason.PROJECTOR_ALTERS, "another source"),
}


# One that alters the picture and one of another kind stand for all.
@pytest.mark.parametrize("name", few_of(PROJECTOR_FAULTS, 2))
def test_a_projectors_fault_is_told_and_dark_in_time(with_projector, name) -> None:
    """Within the pause and two full readings of 1.5 s."""
    deed, reason, words = PROJECTOR_FAULTS[name]
    room = with_projector
    room.happens(deed)
    room.until(lambda: room.is_dark_because(reason), 5.0)
    assert room.bench.state == "navigating"
    assert words in room.line("projector").detail
    room.bench.frames(3)
    assert room.bench.is_dark


@pytest.mark.slow
def test_an_abnormal_projector_is_dark_within_the_time_of_its_probes(with_projector) -> None:
    room = with_projector
    room.happens(lambda projector: projector.break_down(0x04))
    # Sooner than a report is stale: it is the probes that find it.
    room.until(lambda: room.is_dark_because(Reason.PROJECTOR_LOST), 19.0)
    assert "abnormal (lamp, heat)" in room.line("projector").detail
    room.happens(lambda projector: (projector.lose_mains(), projector.restore_mains()))
    room.until(lambda: room.line("projector").detail == "standby", 30.0)


def test_a_projectors_pulled_plug_is_dark_and_it_comes_back_by_itself(with_projector) -> None:
    room = with_projector
    room.terminal.unplug()
    room.until(lambda: room.is_dark_because(Reason.PROJECTOR_LOST), 5.0)
    assert room.line("projector").health is DeviceHealth.LOST
    room.terminal.plug()
    room.until(lambda: room.bench.shows_guides, 10.0)


def test_no_frame_waits_for_the_projectors_slow_line(with_projector) -> None:
    """A full reading takes 1.5 s; a step does not."""
    bench, longest_s = with_projector.bench, 0.0
    end_s = time.monotonic() + 3.0
    while time.monotonic() < end_s:
        begin_s = time.monotonic()
        bench.frames(1)
        longest_s = max(longest_s, time.monotonic() - begin_s)
        time.sleep(0.01)
    assert longest_s < 0.75


class Ending(InlineExecutor):
    """Notes what is so when it is closed."""

    def __init__(self, is_so: Callable[[], bool]) -> None:
        self._is_so = is_so
        self.noted: list[bool] = []

    def close(self) -> None:
        self.noted.append(self._is_so())


def test_closing_a_session_ends_a_motion_before_anything_else(tmp_path) -> None:
    with stage_terminal(tmp_path, speed=0.2) as terminal:
        stage = terminal.wire.firmware
        begin_deg = stage.true_deg
        mirror = mirror_at(terminal)
        mirror.open()
        executor = Ending(lambda: stage.is_busy)
        bench = Bench(mirror=mirror, executor=executor)
        wait_for(lambda: abs(stage.true_deg - begin_deg) > 0.1, "a motion")
        bench.controller.close()
        assert executor.noted == [False]
        stands_deg = stage.true_deg
        assert 1.0 < stands_deg < begin_deg, "neither where it began nor at its home"
        time.sleep(0.5)
        assert not stage.is_busy
        assert stage.true_deg == stands_deg
        with pytest.raises(DeviceError):
            mirror.position_deg()
