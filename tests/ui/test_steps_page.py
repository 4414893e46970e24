"""The page of the stage's steps."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from textual.pilot import Pilot
from textual.widgets import Static

from navapp.control.commands import ConfirmStep, ReadThickness, WithdrawStep
from navapp.control.stages import STAGES
from navapp.control.states import StepLine
from navapp.resection import CaliperPoint, Thickness
from navapp.ui.actions import ACTIONS
from navapp.ui.steps_page import STEP_KEYS, StepsPage, StepTable
from navapp.ui.thickness_question import ThicknessQuestion
from navapp.values import MeasuredFace, ResectionPlane
from tests.ui import snapshots
from tests.ui.test_app import BellCounter, play

PLANE = ResectionPlane("femur", np.zeros(3), np.array([0.0, 0.0, -1.0]))
SMALL = np.diag([2e-6, 2e-6, 2e-3])
FACE = MeasuredFace(PLANE, np.array([np.tan(np.radians(1.3)), 0.0, -0.55]), SMALL, 0.8)
STEPS = (
    StepLine(
        "femur_distal",
        "cut",
        is_made=True,
        measured=FACE,
        seen_share=0.8,
        thickness=Thickness(9.0, 9.55, 0.12),
    ),
    StepLine("femur_anterior", "cut", is_made=True, seen_share=0.38),
    StepLine("femur_posterior", "cut", is_made=True),
    StepLine("femur_anterior_chamfer", "cut", is_made=False),
    StepLine("femoral_implant", "part", is_made=True),
)


def test_the_letters_mean_nothing_else_on_the_page() -> None:
    kept = {
        action.key for action in ACTIONS if action.name in ("quit", "steps", "accept", "reject")
    }
    assert not kept & set(STEP_KEYS)


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
def test_steps_are_told_and_changed_by_their_letters(size: tuple[int, int]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("k")
        assert isinstance(app.screen, StepsPage)
        text = app.text_of(StepTable)
        lines = [line.rstrip() for line in text.splitlines()]
        assert lines[0].split() == ["b", "femur_distal", "cut", "made"]
        assert "tilt     1.30 deg +- 0.20" in lines[1]
        assert "offset  -0.55 mm  +- 0.09" in lines[2]
        assert "tolerance 1.0" in lines[2]
        assert lines.pop(3).split() == ["thick", "9.55", "mm", "+-", "0.12", "planned", "9.00"]
        assert lines[3].split() == ["c", "femur_anterior", "cut", "made"]
        assert (
            lines[4].strip() == "not measurable: 38 % of the cut is seen, its bounds are too large"
        )
        assert lines[6].strip() == "not measurable: it is not seen, or was not looked for yet"
        assert lines[7].split() == ["f", "femur_anterior_chamfer", "cut", "planned"]
        assert lines[8].split() == ["g", "femoral_implant", "part", "made"]
        assert "version 3 of the femur is in force" in text
        assert max(map(len, lines)) <= size[0] - 4
        await pilot.press("B", "f", "f", "G", "h")

    given = snapshots.navigating(steps=STEPS, bone_version=3, stage=STAGES[2])
    app = play(given, script, size)
    assert app.session.commands == [
        WithdrawStep("femur_distal"),
        ConfirmStep("femur_anterior_chamfer"),
        ConfirmStep("femur_anterior_chamfer"),
        WithdrawStep("femoral_implant"),
    ]


CALIPER_POINTS = tuple(
    CaliperPoint(name, np.zeros(2), thickness_mm, 0.2)
    for name, thickness_mm in (("medial", 13.5), ("lateral", 13.8), ("distal", 13.6))
)
PATELLA = StepLine("patella", "cut", is_made=True, caliper_points=CALIPER_POINTS)


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
def test_a_thickness_is_asked_for_and_typed(size: tuple[int, int]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("k")
        text = app.text_of(StepTable)
        assert "not tracked until its remaining thickness is read (r), in mm" in text
        assert "remaining as planned: medial 13.5, lateral 13.8, distal 13.6" in text
        await pilot.press("r", *"13.4,14", "enter")
        assert isinstance(app.screen, ThicknessQuestion)
        told = app.screen.query_one("#thickness-hint", Static)
        assert str(told.content) == "3 numbers are needed, with commas between them"
        await pilot.press(*",12..9", "enter")
        assert isinstance(app.screen, ThicknessQuestion)
        await pilot.press("backspace", "backspace", "9", "enter")
        assert isinstance(app.screen, StepsPage)
        await pilot.press("r", *"1,2,3", "escape")
        assert isinstance(app.screen, StepsPage)

    given = snapshots.navigating(steps=(PATELLA,), stage=STAGES[3])
    app = play(given, script, size)
    assert app.session.commands == [ReadThickness("patella", (13.4, 14.0, 12.9))]


def test_a_thickness_that_was_read_is_told() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("k")
        lines = [line.strip() for line in app.text_of(StepTable).splitlines()]
        assert lines[1] == "remaining as read (r: again): medial 13.2, lateral 14.0, distal 13.1"
        assert lines[2] == "remaining as planned: medial 13.5, lateral 13.8, distal 13.6"
        assert lines[3] == "removed 8.80 mm +-0.30, planned 9.00"

    read = replace(PATELLA, thickness=Thickness(9.0, 8.8, 0.3), remaining_mm=(13.2, 14.0, 13.1))
    play(snapshots.navigating(steps=(read,), stage=STAGES[3]), script, (80, 24))


def test_no_thickness_is_asked_for_before_the_cut_is_made() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("k", "r")
        assert isinstance(app.screen, StepsPage)
        assert app.n_bells == 1

    steps = (replace(PATELLA, is_made=False), *STEPS)
    play(snapshots.navigating(steps=steps, stage=STAGES[3]), script, (80, 24))


def test_why_no_thickness_can_be_read_is_told() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("k", "r")
        assert "not tracked: the cut leans too much" in app.text_of(StepTable)
        assert app.n_bells == 1
        assert [one.message for one in app._notifications] == ["the cut leans too much"]

    why = "the cut leans too much"
    steps = (replace(PATELLA, caliper_points=(), caliper_refusal=why),)
    play(snapshots.navigating(steps=steps, stage=STAGES[3]), script, (80, 24))


def test_steps_for_which_there_is_no_letter_are_told() -> None:
    steps = tuple(StepLine(f"cut_{k}", "cut", is_made=False) for k in range(len(STEP_KEYS) + 2))

    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("k")
        text = app.text_of(StepTable)
        assert all(step.name in text for step in steps)
        assert "2 steps have no letter" in text

    play(snapshots.navigating(steps=steps, stage=STAGES[2]), script, (160, 48))


def test_without_steps_the_page_says_so() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("k")
        assert isinstance(app.screen, StepsPage)
        assert "the plan has no cut, hole or part of the femur" in str(
            app.screen.query_one(StepTable).render()
        )

    play(snapshots.navigating(), script, (80, 24))


@pytest.mark.parametrize(("page", "keys"), [("k", "bB"), ("t", "bB")])
def test_a_letter_is_answered_while_the_session_is_silent(page: str, keys: str) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press(page)
        app._view = replace(app._view, is_silent=True)
        before = app.n_bells
        await pilot.press(*keys)
        assert app.n_bells == before + len(keys)

    app = play(snapshots.navigating(steps=STEPS, stage=STAGES[2]), script, (80, 24))
    assert app.session.commands == []
