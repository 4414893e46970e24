"""What the operator tells the projector: refused in words, carried out, told as events."""

import pytest

from drivers.interfaces import CommandResult, PowerState, ProjectorStatus
from drivers.no_projector import NoProjector
from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import PROJECTOR_SETTINGS, SetProjector
from navapp.control.device_handlers import ProjectorHandler
from navapp.control.states import DeviceHealth, EventLevel
from navapp.errors import DeviceLost, DeviceTimeout, UnsupportedControl
from navapp.values import Reason
from tests.control.fakes import Bench, wait_for
from tests.control.test_session_lines import with_projector  # noqa: F401 (a fixture)

pytestmark = pytest.mark.waits


class Projector(NoProjector):
    """One in a test's hands."""

    def __init__(self, **known) -> None:
        self.state = ProjectorStatus(PowerState.STANDBY, **known)
        self.told: list[tuple[str, object]] = []
        self.error: Exception | None = None
        self.status_error: Exception | None = None
        self.result = CommandResult.VERIFIED

    def _tell(self, what, value):
        if self.error is not None:
            raise self.error
        self.told.append((what, value))
        return self.result

    def set_power(self, is_on, timeout_s):
        return self._tell("power", is_on)

    def set_source(self, source, timeout_s):
        return self._tell("source", source)

    def set_flips(self, horizontally, vertically, timeout_s):
        return self._tell("flips", (horizontally, vertically))

    def status(self):
        if self.status_error is not None:
            raise self.status_error
        return self.state


@pytest.fixture
def projector():
    return Projector(source="30")


@pytest.fixture
def bench(projector, monkeypatch):
    monkeypatch.setattr("navapp.control.device_monitor.PROJECTOR_TIMES_S", (0.05, 20.0))
    made = Bench(projector=projector)
    yield made
    made.controller.close()


def events(bench):
    return [event.text for event in bench.events if event.kind == "projector"]


def answer(bench, name):
    """The event that says what became of it."""
    n_before = len(events(bench))
    bench.do(SetProjector(name))
    bench.until(lambda: len(events(bench)) == n_before + 2, 5.0)
    return events(bench)[-1]


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("on", ("power", True)),
        ("off", ("power", False)),
        ("source", ("source", "30")),
        ("flips", ("flips", (False, False))),
    ],
)
def test_a_setting_reaches_the_driver_and_its_result_is_told(bench, projector, name, told):
    assert answer(bench, name) == f"projector, {PROJECTOR_SETTINGS[name]}: done"
    assert projector.told == [told]


def test_a_command_that_is_only_accepted_is_not_called_done(bench, projector):
    projector.result = CommandResult.ACCEPTED
    assert answer(bench, "on").endswith("accepted, its state tells when it is so")


def test_what_the_driver_cannot_do_is_told_and_ends_nothing(bench, projector):
    projector.error = UnsupportedControl("no flips over PJLink", remedy="set them in its menu")
    assert answer(bench, "flips") == (
        "projector, flips as calibrated failed: no flips over PJLink: set them in its menu"
    )
    assert bench.line("projector").health is DeviceHealth.TROUBLE
    assert bench.events[-1].level is EventLevel.WARNING
    projector.error = None
    assert answer(bench, "on").endswith("done")


def test_a_source_that_was_never_told_cannot_be_set_back():
    handler = ProjectorHandler(Projector())
    handler.report()
    with pytest.raises(UnsupportedControl, match="has not told its source"):
        handler.set("source")


def test_the_first_source_is_set_back_and_not_the_present_one(projector):
    handler = ProjectorHandler(projector)
    handler.report()
    projector.state = ProjectorStatus(PowerState.ON, source="A0")
    assert handler.report().reason is Reason.PROJECTOR_ALTERS
    handler.set("source")
    assert projector.told == [("source", "30")]


@pytest.mark.parametrize("name", PROJECTOR_SETTINGS)
def test_it_is_recorded_and_read_back(name):
    command = SetProjector(name)
    assert command_to_json(command) == {"command": "projector", "name": name}
    assert command_from_json(command_to_json(command)) == command


def test_without_a_projector_it_is_refused_in_words():
    bench = Bench()
    bench.do(SetProjector("on"))
    assert "there is none to be told: name its backend under [projector]" in bench.refused()
    bench.do(SetProjector("colour"))
    assert "no setting 'colour'" in bench.refused()


def test_a_lost_one_is_told_nothing_now_and_nothing_later(bench, projector):
    projector.status_error = DeviceLost("gone")
    bench.until(lambda: bench.line("projector").health is DeviceHealth.LOST, 5.0)
    bench.do(SetProjector("on"))
    assert "it does not answer" in bench.refused()
    projector.status_error = None
    bench.until(lambda: bench.line("projector").health is not DeviceHealth.LOST, 5.0)
    assert projector.told == []


def test_what_was_asked_while_it_was_lost_is_dropped(bench, projector):
    def fail() -> None:
        raise DeviceTimeout("still silent")

    projector.status_error, projector.open = DeviceLost("gone"), fail
    watch = bench.controller._monitored._watches[0]
    wait_for(lambda: watch.report.line.health is DeviceHealth.LOST, "the loss")
    watch.do("projector, power on", lambda: "done")
    bench.until(lambda: "projector, power on failed: it is not there" in events(bench), 10.0)


@pytest.mark.parametrize(
    ("known", "remedy"),
    [
        ({"power": PowerState.STANDBY}, "p switches it on"),
        ({"power": PowerState.WARMING}, "wait until its lamp is warm"),
        ({"power": PowerState.ON, "is_muted": True}, "end its mute"),
        ({"power": PowerState.STANDBY, "faults": ("lamp",)}, "see its own lamps"),
        ({"power": PowerState.ON, "flips_vertically": True}, "f sets its flips"),
    ],
)
def test_one_that_shows_nothing_says_what_to_do(known, remedy):
    projector = Projector()
    projector.state = ProjectorStatus(**known)
    assert remedy in ProjectorHandler(projector).report().line.remedy


def test_a_simulated_projector_is_set_right_and_guides_come_back(with_projector):  # noqa: F811
    """Flipped and of another source it stays dark until it tells that it is as it was."""
    room, bench = with_projector, with_projector.bench
    room.happens(
        lambda firmware: firmware.model.settings.update({"HREVERSE": "ON", "SOURCE": "A0"})
    )
    room.until(lambda: room.is_dark_because(Reason.PROJECTOR_ALTERS), 5.0)
    bench.do(SetProjector("flips"))
    room.until(lambda: room.line("projector").detail == "picture of another source", 8.0)
    assert bench.is_dark
    bench.do(SetProjector("source"))
    room.until(lambda: bench.shows_guides, 8.0)
    assert events(bench)[-1] == "projector, source as before: done"


def test_a_simulated_projector_is_switched_off_and_on(with_projector):  # noqa: F811
    room, bench = with_projector, with_projector.bench
    bench.do(SetProjector("off"))
    room.until(lambda: room.line("projector").detail in ("cooling", "standby"), 10.0)
    room.until(lambda: room.line("projector").detail == "standby", 30.0)
    assert room.line("projector").remedy == "p switches it on"
    bench.do(SetProjector("on"))
    room.until(lambda: room.line("projector").detail == "on", 40.0)
    assert events(bench)[-1].startswith("projector, power on: ")
