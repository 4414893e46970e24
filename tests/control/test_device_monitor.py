"""The monitor of slow devices: what it reports, when it tries again, what it leaves behind."""

import threading
from collections.abc import Callable, Iterator

import pytest

from drivers.clock import ManualClock
from drivers.interfaces import MirrorInfo, PowerState, ProjectorStatus
from navapp.control.backoff import Backoff
from navapp.control.device_handlers import DeviceReport, MirrorHandler, ProjectorHandler
from navapp.control.device_monitor import DeviceMonitor
from navapp.control.states import DeviceHealth, DeviceLine
from navapp.errors import DeviceError, DeviceLost, DeviceNotFound
from navapp.values import Reason
from tests.control.fakes import wait_for

pytestmark = pytest.mark.waits


class FakeHandler:
    """A device in a test's hands."""

    reason = Reason.MIRROR_AWAY
    restoring = "being moved"
    is_slow = True

    def __init__(self) -> None:
        self.health = DeviceHealth.OK
        self.gate = threading.Event()
        self.gate.set()
        self.is_held_in_restore = False
        self.n_stops_needed = 1
        self.error: Exception | None = None
        self.report_error: Exception | None = None
        self.n_asked = self.n_reopened = self.n_begun = self.n_restored = self.n_stopped = 0

    def report(self) -> DeviceReport:
        self.n_asked += 1
        if not self.is_held_in_restore:
            self.gate.wait()
        if self.report_error is not None:
            raise self.report_error
        return DeviceReport(DeviceLine("mirror", "m", self.health, "detail"))

    def restore(self) -> None:
        self.n_begun += 1
        self.gate.wait()
        self.n_restored += 1

    def reopen(self) -> None:
        self.n_reopened += 1
        if self.error is not None:
            raise self.error

    def stop(self) -> None:
        self.n_stopped += 1
        if self.n_stopped >= self.n_stops_needed:
            self.gate.set()


@pytest.fixture
def handler() -> FakeHandler:
    return FakeHandler()


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def monitor(handler, clock) -> Iterator[DeviceMonitor]:
    made = DeviceMonitor(handler, (0.01, 1.0), clock)
    yield made
    handler.gate.set()
    made.close()


def test_the_first_report_is_there_at_once_and_renewed(monitor, handler) -> None:
    assert monitor.report.line.health is DeviceHealth.OK
    wait_for(lambda: handler.n_asked > 3, "more questions")


def test_a_device_that_is_not_slow_is_asked_for_every_report() -> None:
    handler = FakeHandler()
    handler.is_slow = False
    monitor = DeviceMonitor(handler, (0.01, 1.0))
    before = handler.n_asked
    assert monitor.report.line.detail == "detail"
    assert handler.n_asked == before + 1
    monitor.close()


def test_an_answer_that_stays_away_makes_the_device_lost(monitor, handler, clock) -> None:
    handler.gate.clear()
    wait_for(lambda: monitor._made is not None and handler.n_asked > 1, "a question")
    clock.advance_ns(3 * 10**9)
    report = monitor.report
    assert report.reason is Reason.MIRROR_AWAY
    assert report.line.health is DeviceHealth.LOST
    assert "has not answered" in report.line.detail
    handler.gate.set()
    wait_for(lambda: monitor.report.line.health is DeviceHealth.OK, "its return")
    assert monitor.report.reason is None


def test_a_lost_device_is_opened_again_and_its_error_told(monitor, handler, clock) -> None:
    monitor._pauses = Backoff(0.01, 8.0)
    handler.error = DeviceNotFound("not plugged in")
    handler.health = DeviceHealth.LOST
    wait_for(lambda: monitor.report.line.detail == "not plugged in", "the error")
    assert monitor.report.reason is Reason.MIRROR_AWAY
    clock.advance_ns(10**11)
    assert monitor.report.line.detail == "not plugged in", "however long the pauses become"
    handler.error, handler.health = None, DeviceHealth.OK
    monitor.restore()
    wait_for(lambda: monitor.report.line.health is DeviceHealth.OK, "its return")
    assert handler.n_reopened >= 2


@pytest.mark.parametrize("where", ["report_error", "error"])
def test_a_bug_ends_as_a_lost_device_and_the_thread_goes_on(monitor, handler, where) -> None:
    monitor._pauses = Backoff(0.01, 0.01)
    handler.health = DeviceHealth.LOST
    setattr(handler, where, RuntimeError("a bug"))
    wait_for(lambda: "RuntimeError('a bug')" in monitor.report.line.detail, "the words")
    assert monitor.report.line.health is DeviceHealth.LOST
    assert monitor.report.reason is Reason.MIRROR_AWAY
    monitor.restore()
    wait_for(lambda: not monitor._is_restoring, "an end of what the operator asked for")
    setattr(handler, where, None)
    handler.health = DeviceHealth.OK
    wait_for(lambda: monitor.report.line.health is DeviceHealth.OK, "its return")
    assert monitor.report.reason is None


def test_the_pauses_between_attempts_double(handler, clock, monkeypatch) -> None:
    pauses_s = []
    monkeypatch.setattr("navapp.control.device_monitor._PAUSES_S", (0.01, 0.05))
    handler.health, handler.error = DeviceHealth.LOST, DeviceLost("gone")
    monitor = DeviceMonitor(handler, (0.002, 1.0), clock)
    wait = monitor._wake.wait
    monitor._wake.wait = lambda pause_s: pauses_s.append(pause_s) or wait(pause_s)
    wait_for(lambda: len(pauses_s) > 6, "attempts")
    monitor.close()
    assert set(pauses_s) <= {0.002, 0.01, 0.02, 0.04, 0.05}
    assert pauses_s[-3:] == [0.05] * 3
    assert pauses_s == sorted(pauses_s), "never shorter while it stays away"


def test_attempts_become_rarer_and_the_operator_does_not_wait(monitor, handler) -> None:
    monitor._pauses = Backoff(30.0, 30.0)
    handler.health, handler.error = DeviceHealth.LOST, DeviceLost("gone")
    wait_for(lambda: monitor.report.line.health is DeviceHealth.LOST, "the loss")
    assert handler.n_reopened <= 1
    handler.error, handler.health = None, DeviceHealth.OK
    monitor.restore()
    wait_for(lambda: monitor.report.line.health is DeviceHealth.OK, "its return")


def test_while_it_is_restored_it_is_said_and_closing_stops_it(handler, clock) -> None:
    handler.is_held_in_restore = True
    monitor = DeviceMonitor(handler, (0.01, 1.0), clock)
    handler.gate.clear()
    monitor.restore()
    assert monitor.report.line.detail == "being moved"
    assert monitor.report.reason is Reason.MIRROR_AWAY
    wait_for(lambda: handler.n_begun == 1, "its beginning")
    monitor.close()
    assert handler.n_stopped > 0


def test_closing_stops_it_until_it_stands(handler, clock) -> None:
    """A stop that comes before a motion begins ends nothing."""
    handler.n_stops_needed = 3
    handler.is_held_in_restore = True
    monitor = DeviceMonitor(handler, (0.01, 1.0), clock)
    handler.gate.clear()
    monitor.restore()
    wait_for(lambda: handler.n_begun == 1, "its beginning")
    monitor.close()
    assert handler.n_stopped == 3
    assert handler.n_restored == 1


class Projector:
    """Says what it is told to say."""

    name = "projector"

    def __init__(self, **status) -> None:
        self.say(**status)

    def say(self, power: PowerState = PowerState.ON, **status) -> None:
        self.answer = ProjectorStatus(power, **status)

    def status(self) -> ProjectorStatus:
        return self.answer


@pytest.mark.parametrize(
    ("status", "words"),
    [
        ({"flips_horizontally": True}, "flipped"),
        ({"flips_vertically": True}, "flipped"),
        ({"is_frozen": True}, "frozen"),
        ({"keystone": (126, 130)}, "with another keystone"),
        ({"source": "A0"}, "of another source"),
    ],
)
def test_a_projector_that_alters_the_picture_forbids_guides(status, words) -> None:
    projector = Projector(keystone=(126, 126), source="30", flips_horizontally=False)
    handler = ProjectorHandler(projector)
    assert handler.report().reason is None
    projector.say(**{"keystone": (126, 126), "source": "30", **status})
    report = handler.report()
    assert report.reason is Reason.PROJECTOR_ALTERS
    assert report.line.health is DeviceHealth.TROUBLE
    assert words in report.line.detail
    projector.say(keystone=(126, 126))
    assert handler.report().reason is None


def test_a_source_that_changed_while_the_lamp_was_out_forbids_guides() -> None:
    projector = Projector(power=PowerState.WARMING)
    handler = ProjectorHandler(projector)
    for source, reason in (("30", None), (None, None), ("A0", Reason.PROJECTOR_ALTERS)):
        handler.report()
        projector.say(PowerState.ON if source else PowerState.STANDBY, source=source)
        assert handler.report().reason is reason


@pytest.mark.parametrize(
    "power", [PowerState.STANDBY, PowerState.WARMING, PowerState.COOLING, PowerState.UNKNOWN]
)
def test_a_lamp_that_is_not_on_is_told(power) -> None:
    report = ProjectorHandler(Projector(power=power)).report()
    assert (report.line.health, report.line.detail) == (DeviceHealth.TROUBLE, power.value)
    assert report.reason is None, "nobody sees guides that no lamp shows"
    both = ProjectorHandler(Projector(power=power, faults=("filter",))).report().line.detail
    assert both == f"{power.value}, filter"


def test_a_hidden_picture_is_told() -> None:
    report = ProjectorHandler(Projector(is_muted=True, faults=("filter",))).report()
    assert (report.line.health, report.line.detail) == (DeviceHealth.TROUBLE, "muted, filter")
    assert report.reason is None, "nobody sees guides that are hidden"


def test_a_fault_of_the_lamp_forbids_guides_and_a_clogged_filter_does_not() -> None:
    handler = ProjectorHandler(Projector(power=PowerState.FAULT, faults=("lamp",)))
    assert handler.report().reason is Reason.PROJECTOR_LOST
    report = ProjectorHandler(Projector(faults=("filter",))).report()
    assert report.reason is None
    assert (report.line.health, report.line.detail) == (DeviceHealth.TROUBLE, "filter")


class Mount:
    """A mirror mount in a test's hands."""

    info = MirrorInfo("mount", "test", is_simulated=False, is_movable=True)

    def __init__(self, angle_deg: float | None) -> None:
        self.angle_deg = angle_deg
        self.error: DeviceError | None = None
        self.done: list[str] = []
        self.on_home: Callable[[], object] = lambda: None

    def position_deg(self) -> float | None:
        return self.angle_deg

    def home(self, timeout_s: float) -> None:
        self.done.append("home")
        self.on_home()
        self.angle_deg = 0.0

    def move_to(self, angle_deg: float, timeout_s: float) -> None:
        if self.error is not None:
            raise self.error
        self.done.append(f"move {angle_deg}")
        self.angle_deg = angle_deg

    def stop(self) -> None:
        raise DeviceLost("gone")


@pytest.mark.parametrize(
    ("angle_deg", "done"),
    [(45.0, []), (45.01, []), (44.0, ["move 45.0"]), (None, ["home", "move 45.0"])],
)
def test_a_mirror_is_brought_to_its_place_only_when_it_is_not_there(angle_deg, done) -> None:
    mount = Mount(angle_deg)
    handler = MirrorHandler(mount, 45.0)
    handler.restore()
    assert mount.done == done
    assert handler.report().reason is None


def test_what_kept_a_mirror_from_its_place_is_told_until_it_is_there() -> None:
    mount = Mount(44.0)
    mount.error = DeviceError("the mirror stalled")
    handler = MirrorHandler(mount, 45.0)
    assert "44.0 deg, calibrated at 45.0 deg" in handler.report().line.detail
    handler.restore()
    assert handler.report().line.detail == "the mirror stalled"
    mount.angle_deg = 45.0
    assert handler.report().line.health is DeviceHealth.OK
    mount.angle_deg = 44.0
    assert "calibrated" in handler.report().line.detail
    handler.stop()
    assert handler.report().line.detail == "gone"


def test_a_mirror_that_was_stopped_is_not_moved_any_more() -> None:
    mount = Mount(None)
    handler = MirrorHandler(mount, 45.0)
    mount.on_home = handler.stop
    handler.restore()
    assert mount.done == ["home"], "stopped between its two motions"
    mount.angle_deg = None
    handler.restore()
    assert mount.done == ["home"]
