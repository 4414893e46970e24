"""The watch over slow devices: what it reports, when it tries again, and what it leaves behind."""

import threading
from collections.abc import Callable, Iterator

import pytest

from drivers.clock import ManualClock
from drivers.interfaces import MirrorInfo, PowerState, ProjectorStatus
from navapp.control.device_care import MirrorCare, ProjectorCare, Report
from navapp.control.device_watch import DeviceWatch
from navapp.control.pauses import Pauses
from navapp.control.states import DeviceHealth, DeviceLine
from navapp.errors import DeviceError, DeviceLost, DeviceNotFound
from navapp.values import Reason
from tests.control.fakes import wait_for


class Care:
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

    def report(self) -> Report:
        self.n_asked += 1
        if not self.is_held_in_restore:
            self.gate.wait()
        if self.report_error is not None:
            raise self.report_error
        return Report(DeviceLine("mirror", "m", self.health, "detail"))

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
def care() -> Care:
    return Care()


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def watch(care, clock) -> Iterator[DeviceWatch]:
    made = DeviceWatch(care, (0.01, 1.0), clock)
    yield made
    care.gate.set()
    made.close()


def test_the_first_report_is_there_at_once_and_renewed(watch, care) -> None:
    assert watch.report.line.health is DeviceHealth.OK
    wait_for(lambda: care.n_asked > 3, "more questions")


def test_a_device_that_is_not_slow_is_asked_for_every_report() -> None:
    care = Care()
    care.is_slow = False
    watch = DeviceWatch(care, (0.01, 1.0))
    before = care.n_asked
    assert watch.report.line.detail == "detail"
    assert care.n_asked == before + 1
    watch.close()


def test_an_answer_that_stays_away_makes_the_device_lost(watch, care, clock) -> None:
    care.gate.clear()
    wait_for(lambda: watch._made is not None and care.n_asked > 1, "a question")
    clock.advance_ns(3 * 10**9)
    report = watch.report
    assert report.reason is Reason.MIRROR_AWAY
    assert report.line.health is DeviceHealth.LOST
    assert "has not answered" in report.line.detail
    care.gate.set()
    wait_for(lambda: watch.report.line.health is DeviceHealth.OK, "its return")
    assert watch.report.reason is None


def test_a_lost_device_is_opened_again_and_its_error_told(watch, care, clock) -> None:
    watch._pauses = Pauses(0.01, 8.0)
    care.error = DeviceNotFound("not plugged in")
    care.health = DeviceHealth.LOST
    wait_for(lambda: watch.report.line.detail == "not plugged in", "the error")
    assert watch.report.reason is Reason.MIRROR_AWAY
    clock.advance_ns(10**11)
    assert watch.report.line.detail == "not plugged in", "however long the pauses become"
    care.error, care.health = None, DeviceHealth.OK
    watch.restore()
    wait_for(lambda: watch.report.line.health is DeviceHealth.OK, "its return")
    assert care.n_reopened >= 2


@pytest.mark.parametrize("where", ["report_error", "error"])
def test_a_bug_ends_as_a_lost_device_and_the_thread_goes_on(watch, care, where) -> None:
    watch._pauses = Pauses(0.01, 0.01)
    care.health = DeviceHealth.LOST
    setattr(care, where, RuntimeError("a bug"))
    wait_for(lambda: "RuntimeError('a bug')" in watch.report.line.detail, "the words")
    assert watch.report.line.health is DeviceHealth.LOST
    assert watch.report.reason is Reason.MIRROR_AWAY
    watch.restore()
    wait_for(lambda: not watch._is_restoring, "an end of what the operator asked for")
    setattr(care, where, None)
    care.health = DeviceHealth.OK
    wait_for(lambda: watch.report.line.health is DeviceHealth.OK, "its return")
    assert watch.report.reason is None


def test_the_pauses_between_attempts_double(care, clock, monkeypatch) -> None:
    pauses_s = []
    monkeypatch.setattr("navapp.control.device_watch._PAUSES_S", (0.01, 0.05))
    care.health, care.error = DeviceHealth.LOST, DeviceLost("gone")
    watch = DeviceWatch(care, (0.002, 1.0), clock)
    wait = watch._wake.wait
    watch._wake.wait = lambda pause_s: pauses_s.append(pause_s) or wait(pause_s)
    wait_for(lambda: len(pauses_s) > 6, "attempts")
    watch.close()
    assert set(pauses_s) <= {0.002, 0.01, 0.02, 0.04, 0.05}
    assert pauses_s[-3:] == [0.05] * 3
    assert pauses_s == sorted(pauses_s), "never shorter while it stays away"


def test_attempts_become_rarer_and_the_operator_does_not_wait(watch, care) -> None:
    watch._pauses = Pauses(30.0, 30.0)
    care.health, care.error = DeviceHealth.LOST, DeviceLost("gone")
    wait_for(lambda: watch.report.line.health is DeviceHealth.LOST, "the loss")
    assert care.n_reopened <= 1
    care.error, care.health = None, DeviceHealth.OK
    watch.restore()
    wait_for(lambda: watch.report.line.health is DeviceHealth.OK, "its return")


def test_while_it_is_restored_it_is_said_and_closing_stops_it(care, clock) -> None:
    care.is_held_in_restore = True
    watch = DeviceWatch(care, (0.01, 1.0), clock)
    care.gate.clear()
    watch.restore()
    assert watch.report.line.detail == "being moved"
    assert watch.report.reason is Reason.MIRROR_AWAY
    wait_for(lambda: care.n_begun == 1, "its beginning")
    watch.close()
    assert care.n_stopped > 0


def test_closing_stops_it_until_it_stands(care, clock) -> None:
    """A stop that comes before a motion begins ends nothing."""
    care.n_stops_needed = 3
    care.is_held_in_restore = True
    watch = DeviceWatch(care, (0.01, 1.0), clock)
    care.gate.clear()
    watch.restore()
    wait_for(lambda: care.n_begun == 1, "its beginning")
    watch.close()
    assert care.n_stopped == 3
    assert care.n_restored == 1


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
    care = ProjectorCare(projector)
    assert care.report().reason is None
    projector.say(**{"keystone": (126, 126), "source": "30", **status})
    report = care.report()
    assert report.reason is Reason.PROJECTOR_ALTERS
    assert report.line.health is DeviceHealth.TROUBLE
    assert words in report.line.detail
    projector.say(keystone=(126, 126))
    assert care.report().reason is None


def test_a_source_that_changed_while_the_lamp_was_out_forbids_guides() -> None:
    projector = Projector(power=PowerState.WARMING)
    care = ProjectorCare(projector)
    for source, reason in (("30", None), (None, None), ("A0", Reason.PROJECTOR_ALTERS)):
        care.report()
        projector.say(PowerState.ON if source else PowerState.STANDBY, source=source)
        assert care.report().reason is reason


@pytest.mark.parametrize(
    "power", [PowerState.STANDBY, PowerState.WARMING, PowerState.COOLING, PowerState.UNKNOWN]
)
def test_a_lamp_that_is_not_on_is_told(power) -> None:
    report = ProjectorCare(Projector(power=power)).report()
    assert (report.line.health, report.line.detail) == (DeviceHealth.TROUBLE, power.value)
    assert report.reason is None, "nobody sees guides that no lamp shows"
    both = ProjectorCare(Projector(power=power, faults=("filter",))).report().line.detail
    assert both == f"{power.value}, filter"


def test_a_hidden_picture_is_told() -> None:
    report = ProjectorCare(Projector(is_muted=True, faults=("filter",))).report()
    assert (report.line.health, report.line.detail) == (DeviceHealth.TROUBLE, "muted, filter")
    assert report.reason is None, "nobody sees guides that are hidden"


def test_a_fault_of_the_lamp_forbids_guides_and_a_clogged_filter_does_not() -> None:
    care = ProjectorCare(Projector(power=PowerState.FAULT, faults=("lamp",)))
    assert care.report().reason is Reason.PROJECTOR_LOST
    report = ProjectorCare(Projector(faults=("filter",))).report()
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
    care = MirrorCare(mount, 45.0)
    care.restore()
    assert mount.done == done
    assert care.report().reason is None


def test_what_kept_a_mirror_from_its_place_is_told_until_it_is_there() -> None:
    mount = Mount(44.0)
    mount.error = DeviceError("the mirror stalled")
    care = MirrorCare(mount, 45.0)
    assert "44.0 deg, calibrated at 45.0 deg" in care.report().line.detail
    care.restore()
    assert care.report().line.detail == "the mirror stalled"
    mount.angle_deg = 45.0
    assert care.report().line.health is DeviceHealth.OK
    mount.angle_deg = 44.0
    assert "calibrated" in care.report().line.detail
    care.stop()
    assert care.report().line.detail == "gone"


def test_a_mirror_that_was_stopped_is_not_moved_any_more() -> None:
    mount = Mount(None)
    care = MirrorCare(mount, 45.0)
    mount.on_home = care.stop
    care.restore()
    assert mount.done == ["home"], "stopped between its two motions"
    mount.angle_deg = None
    care.restore()
    assert mount.done == ["home"]
