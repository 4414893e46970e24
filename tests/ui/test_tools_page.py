"""The page of tools and of the check on the patient."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from textual.pilot import Pilot

from navapp.control.commands import CheckPicks, DropPoint, ForgetPoints, TouchPoint
from navapp.control.states import PatientCheck, Snapshot, ToolLine, ToolReading
from navapp.geometry.transform import RigidTransform
from navapp.tools.patient_check import CheckAnswer, CheckResult
from navapp.tools.tool import SeenTool
from navapp.tools.tool_on_bone import HoleOffset, ToolOnBone
from navapp.ui.actions import ACTIONS
from navapp.ui.picks_page import PicksPage
from navapp.ui.tools_page import LANDMARK_KEYS, ToolsPage, ToolTable
from tests.control.held_pointer import POINTER
from tests.ui import snapshots
from tests.ui.terminals import SIZES
from tests.ui.test_app import BellCounter, play

LANDMARKS = {
    "femur/medial_condyle": np.array([20.0, 0.0, 0.0]),
    "femur/notch": np.array([0.0, 0.0, 0.0]),
    "femur/trochlea": np.array([0.0, -20.0, 0.0]),
}
SEEN = SeenTool(POINTER, RigidTransform.identity("left", "plate"), 1e-6 * np.eye(6), 0.83, 5_000)
PLACED = ToolOnBone(
    SEEN, "femur", np.array([1.0, 2.0, 3.0]), None, 0.0064 * np.eye(3) / 7.815 * 4.0, None
)
READING = ToolReading(
    SEEN, PLACED, -0.12, ("femur/notch", 3.74), HoleOffset("canal", 1.4, -6.5, 2.3, 0.4)
)
RESULT = CheckResult(CheckAnswer.OPEN, 0.21, 0.0, 1.32, 1.0, "", "size: cannot tell 2 %")
CHECK = PatientCheck(
    CheckAnswer.OPEN, "femur", 4, RESULT, "at the cross, 7 mm from notch", np.zeros(3), True
)


def a_snapshot(**changes: Any) -> Snapshot:
    shown = dataclasses.replace(
        snapshots.navigating(),
        tools=(ToolLine("pointer", READING, "", 40.0),),
        patient_check=CHECK,
        landmarks=LANDMARKS,
    )
    return dataclasses.replace(shown, **changes)


def text_at(size: tuple[int, int], snapshot: Snapshot) -> str:
    told: list[str] = []

    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("u")
        assert isinstance(app.screen, ToolsPage)
        told.append(app.text_of(ToolTable))

    play(snapshot, script, size=size)
    return told[0]


def test_the_letters_mean_nothing_else_on_the_page() -> None:
    kept = {one.key for one in ACTIONS if one.name in ("quit", "tools", "reject")} | set("xnu")
    assert not kept & set(LANDMARK_KEYS)


@SIZES
def test_tool_and_check_are_told_at_all_sizes(size: tuple[int, int]) -> None:
    text = text_at(size, a_snapshot())
    for words in (
        "pointer", "83 % of its plate seen, 40 ms old", "-0.12 mm", "0.16",
        "notch 3.7 mm away", "hole canal", "off line", "1.40 mm", "2.30 deg", "-6.50 mm",
        "4 points: more points", "0.21 mm off", "0.00 to 1.32, 1.0 allowed",
        "size: cannot tell 2 %", "touch next at the cross, 7 mm from notch",
        "b  medial condyle",
    ):  # fmt: skip
        assert words in text, words


@pytest.mark.parametrize(
    ("changes", "words", "silent"),
    [
        ({"tools": (), "patient_check": None}, "(p, then k) can find an error", "surface "),
        (
            {"tools": (ToolLine("pointer", None, "no marker is seen by both cameras"),)},
            "no marker is seen by both cameras",
            "plate seen",
        ),
        ({"tools": (ToolLine("pointer", READING, "", 900.0),)}, "not seen lately", "-0.12"),
        (
            {"tools": (ToolLine("pointer", ToolReading(SEEN, None), "", 40.0),)},
            "the bone is not OK",
            "surface ",
        ),
        ({"patient_check": None}, "press ENTER", "points:"),
        (
            {"patient_check": dataclasses.replace(CHECK, is_valid=False)},
            "press ENTER",
            "4 points",
        ),
    ],
)
def test_nothing_old_or_unknown_stands_as_a_number(
    changes: dict[str, Any], words: str, silent: str
) -> None:
    text = text_at((160, 48), a_snapshot(**changes))
    assert words in text
    assert silent not in text


def test_a_failed_check_says_why() -> None:
    failed = dataclasses.replace(RESULT, answer=CheckAnswer.FAILED, reason="1.8 mm beside")
    check = dataclasses.replace(CHECK, answer=CheckAnswer.FAILED, result=failed, wanted="")
    text = text_at((160, 48), a_snapshot(patient_check=check))
    assert "failed" in text
    assert "1.8 mm beside" in text


def test_a_failed_check_is_told_after_its_points_are_forgotten() -> None:
    check = dataclasses.replace(CHECK, n_touches=0, result=None, wanted="", has_failed=True)
    text = text_at((160, 48), a_snapshot(patient_check=check))
    assert "a check of this registration failed" in text
    assert "more points" not in text


def test_points_are_taken_dropped_and_forgotten_by_keys() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("u", "enter", "b", "m", "x", "n")
        assert app.session.commands == [
            TouchPoint(), TouchPoint("femur/medial_condyle"), DropPoint(), ForgetPoints(),
        ]  # fmt: skip

    play(a_snapshot(), script)


def test_picked_landmarks_are_checked_by_k() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("p")
        assert isinstance(app.screen, PicksPage)
        await pilot.press("k")
        assert app.session.commands == []  # three are needed
        for _ in LANDMARKS:
            await pilot.press("enter", *["shift+right"] * 2)
        await pilot.press("k")
        await pilot.pause()
        (command,) = app.session.commands
        assert isinstance(command, CheckPicks)
        assert {pick.name for pick in command.picks} == set(LANDMARKS)

    play(a_snapshot(picture_size_px=(160, 90), left_picture=snapshots.picture()), script)
