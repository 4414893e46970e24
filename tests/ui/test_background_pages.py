"""The pages of what a session stands on: settings and calibrations."""

import dataclasses
from collections.abc import Callable
from datetime import date
from typing import Any

import pytest
from textual.pilot import Pilot
from textual.widgets import Static

from navapp.config import Configuration
from navapp.control.length_check import Finding, LengthCheck
from navapp.control.specification import SessionSpecification
from navapp.control.states import Snapshot
from navapp.geometry.rig import RigQuality
from navapp.ui.app import NavigationApp
from navapp.ui.background import Background
from navapp.ui.calibration_page import CalibrationTable, list_calibrations
from navapp.ui.settings_page import find_changed, list_settings
from navapp.ui.view import Level
from navapp.values import Prior, RowCheck
from tests.control.fakes import a_plan, a_rig
from tests.control.held_pointer import POINTER
from tests.ui import snapshots
from tests.ui.terminals import SIZES
from tests.ui.test_app import BellCounter, play

TODAY = date(2026, 3, 1)


def a_background(quality: RigQuality | None = None, **changes: Any) -> Background:
    rig = dataclasses.replace(a_rig(), quality=quality)
    given = SessionSpecification(rig, a_plan(), Prior(), **changes)
    configuration = Configuration.model_validate({"tracking": {"method": "paper"}})
    return Background(configuration, given, TODAY, "/home/ward/navapp.toml")


def quality(days_left: int, **changes: Any) -> RigQuality:
    made_on = date(2026, 2, 1)
    expires_on = date.fromordinal(TODAY.toordinal() + days_left)
    return RigQuality(True, (), 0.12, made_on, expires_on, **changes)


def facts(background: Background, snapshot: Snapshot, title: str) -> list[tuple[Level, str]]:
    return list_calibrations(background, snapshot)[title]


def test_every_key_of_the_configuration_is_listed_with_its_table() -> None:
    listed = list_settings(Configuration())
    assert ("tracking", 'method = "bimcc"') in listed
    assert {"camera", "camera.simulated", "ui"} <= {table for table, _ in listed}
    assert find_changed(Configuration()) == []
    assert find_changed(a_background().configuration) == [("tracking", 'method = "paper"')]


@pytest.mark.parametrize(
    ("days_left", "level", "words"),
    [
        (-1, Level.BAD, "EXPIRED on 2026-02-28"),
        (0, Level.ATTENTION, "good until 2026-03-01, 0 days left"),
        (14, Level.ATTENTION, "14 days left"),
        (15, Level.OK, "15 days left"),
    ],
)
def test_the_end_of_a_calibration_is_told_before_it_comes(
    days_left: int, level: Level, words: str
) -> None:
    told = facts(a_background(quality(days_left)), snapshots.navigating(), "rig sim:rig")
    assert any(one is level and words in text for one, text in told)
    assert (Level.QUIET, "made on 2026-02-01, 28 days ago") in told


def test_a_rig_without_a_record_is_no_good_news() -> None:
    told = facts(a_background(), snapshots.navigating(), "rig sim:rig")
    assert (Level.ATTENTION, "no quality record: nobody says how good it is, or how old") in told


def test_a_rig_that_was_not_accepted_says_why() -> None:
    refused = dataclasses.replace(quality(90), is_accepted=False, reasons=("too few views",))
    told = facts(a_background(refused), snapshots.navigating(), "rig sim:rig")
    assert (Level.BAD, "NOT accepted: too few views") in told


@pytest.mark.parametrize(
    ("changes", "level", "words"),
    [
        ({}, Level.QUIET, "rows: not known until a bone is followed"),
        ({"rows": RowCheck(0.02, False)}, Level.OK, "0.02 px too low: within"),
        ({"rows": RowCheck(-0.9, True)}, Level.BAD, "0.90 px too high: too much"),
        ({"rig_alarm": "the rig has moved"}, Level.BAD, "the rig has moved; calibrate again"),
        (
            {"length_check": LengthCheck(0, 1.0, 0.001, 4, Finding.WITHIN)},
            Level.OK,
            "100 mm on the board are measured as 100.00 +- 0.10 mm",
        ),
    ],
)
def test_what_has_moved_is_told(changes: dict[str, Any], level: Level, words: str) -> None:
    told = facts(a_background(), snapshots.navigating(**changes), "what has moved since")
    assert any(one is level and words in text for one, text in told)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, (Level.QUIET, "not measured (navapp calibrate latency)")),
        (
            {"display_delay_ms": 40.0, "display_delay_bound_ms": 6.0},
            (Level.OK, "40 +- 6 ms"),
        ),
        ({"display_delay_ms": 40.0}, (Level.ATTENTION, "40 ms; its bound is not known")),
    ],
)
def test_the_display_s_delay_is_told_with_its_bound(
    changes: dict[str, Any], told: tuple[Level, str]
) -> None:
    assert facts(a_background(**changes), snapshots.navigating(), "display's delay") == [told]


def test_tools_tell_their_age_and_another_rig() -> None:
    pointer = dataclasses.replace(POINTER, made_on=date(2026, 2, 27), rig_id="another")
    background = a_background(tools={"pointer": pointer})
    told = facts(background, snapshots.navigating(), "pointer")
    assert (Level.QUIET, "made on 2026-02-27, 2 days ago") in told
    assert (Level.ATTENTION, "calibrated with another rig") in told
    assert facts(background, snapshots.navigating(), "drill") == [
        (Level.QUIET, "none: name its file in [tools] drill")
    ]


@SIZES
@pytest.mark.parametrize("key", ["h", "s"], ids=["calibration", "settings"])
def test_page(key: str, size: tuple[int, int], snap_compare: Callable[..., bool]) -> None:
    app = NavigationApp(
        snapshots.ScriptedSession(snapshots.navigating(rows=RowCheck(0.03, False))),
        polls_per_s=0,
        background=a_background(quality(100)),
    )
    assert snap_compare(app, press=[key], terminal_size=size)


def test_all_of_the_calibrations_can_be_reached_and_change_while_they_are_shown() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        app._background = a_background(quality(100))
        await pilot.press("h")
        await pilot.pause()
        table = app.screen.query_one(CalibrationTable)
        assert table.size.height == len(str(table.render()).splitlines())
        assert "0.03" not in str(table.render())
        app.session.current = snapshots.navigating(rows=RowCheck(0.03, False))
        app.poll_until_text()
        await pilot.pause()
        assert "0.03 px too low" in str(table.render())
        await pilot.press("h", "s")
        await pilot.pause()
        assert "navapp.toml" in str(app.screen.query_one("#settings", Static).content)

    play(snapshots.navigating(), script, (80, 24))


def test_without_them_the_keys_say_so() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("h")
        await pilot.pause()
        told = [one.message for one in app._notifications]
        assert told == ["the calibration of this session is not known here"]

    play(snapshots.navigating(), script)
