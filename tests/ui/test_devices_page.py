"""The devices' page: keys for the projector, the question before it goes off, what to do."""

from typing import Any

import pytest
from textual.pilot import Pilot

from navapp.control.commands import SetProjector
from navapp.control.states import DeviceHealth, DeviceLine
from navapp.ui.pages import DeviceDetails, DevicesPage, PowerQuestion
from tests.ui import snapshots
from tests.ui.test_app import BellCounter, play, press
from tests.ui.test_panels import lines_of, view_of


@pytest.mark.parametrize(("key", "name"), [("p", "on"), ("s", "source"), ("f", "flips")])
def test_a_key_of_the_page_tells_the_projector_a_setting(key: str, name: str) -> None:
    app = play(snapshots.navigating(), press("d", key))
    assert app.session.commands == [SetProjector(name)]


def test_off_is_asked_first() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("d", "P")
        assert isinstance(app.screen, PowerQuestion)
        assert app.session.commands == []
        await pilot.press("y")
        assert isinstance(app.screen, DevicesPage)

    assert play(snapshots.navigating(), script).session.commands == [SetProjector("off")]


@pytest.mark.parametrize("key", ["n", "escape", "q"])
def test_off_is_not_told_without_a_yes(key: str) -> None:
    assert play(snapshots.navigating(), press("d", "P", key)).session.commands == []


def test_the_keys_mean_nothing_of_it_on_the_main_screen() -> None:
    commands = play(snapshots.navigating(), press("P", "s", "f")).session.commands
    assert not any(isinstance(command, SetProjector) for command in commands)


def test_a_session_that_gives_no_answer_is_told_nothing() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        for _ in range(60):
            app.poll()
        await pilot.press("d", "p")

    app = play(snapshots.navigating(), script)
    assert app.session.commands == []
    assert app.n_bells > 0


def test_a_device_in_trouble_says_what_to_do_below_what_is_wrong() -> None:
    line = DeviceLine(
        "projector", "beamer", DeviceHealth.TROUBLE, "standby", remedy="p switches it on"
    )
    view = view_of(snapshots.navigating(devices=(*snapshots.DEVICES[:2], line)))
    lines = [one.strip() for one in lines_of(DeviceDetails("details"), view, 80, 20)]
    place = lines.index("standby")
    assert lines[place + 1] == "-> p switches it on"
    assert sum(one.startswith("->") for one in lines) == 1


def test_a_long_remedy_is_wrapped() -> None:
    remedy = "set keystone and freeze back on the projector, then look again"
    line = DeviceLine("projector", "b", DeviceHealth.TROUBLE, "bent", remedy=remedy)
    view = view_of(snapshots.navigating(devices=(line,)))
    lines = [one.strip() for one in lines_of(DeviceDetails("details"), view, 40, 20)]
    place = next(i for i, one in enumerate(lines) if one.startswith("->"))
    assert " ".join(lines[place:]).removeprefix("-> ") == remedy
