"""The page of the time-out and of the gate before the next stage."""

from typing import Any

import pytest
from textual.pilot import Pilot

from navapp.control.commands import (
    Blank,
    ConfirmCondition,
    EnterStage,
    OverrideGate,
    WithdrawCondition,
)
from navapp.control.stages import STAGES
from navapp.ui.actions import ACTIONS
from navapp.ui.gates_page import CONDITION_KEYS, REASONS, GatesPage, GateTable
from navapp.values import Reason
from tests.ui import snapshots
from tests.ui.test_app import BellCounter, play


def test_the_letters_mean_nothing_else_on_the_page() -> None:
    kept = {
        action.key for action in ACTIONS if action.name in ("quit", "gates", "accept", "reject")
    }
    assert not kept & set(CONDITION_KEYS)


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
def test_conditions_are_told_and_changed_by_their_letters(size: tuple[int, int]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("t")
        lines = [line.strip() for line in app.text_of(GateTable).splitlines()]
        assert "b  ● met  this is the plan's patient: knee phantom  confirmed 3 min ago" in lines
        assert "● met  the rig is calibrated" in lines
        assert "before stage 3 implant" in lines
        assert "▲ open hole femoral_guide drilled  not confirmed" in lines
        assert max(map(len, lines)) <= size[0] - 4
        await pilot.press("b", "B", "d", "enter", "space")

    app = play(snapshots.navigating(), script, size)
    assert app.session.commands == [
        ConfirmCondition("patient"), WithdrawCondition("patient"), ConfirmCondition("entry_point"),
        EnterStage(3), Blank(),
    ]  # fmt: skip


def test_a_refused_gate_opens_the_page_and_is_overridden_by_a_reason() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        app.session.current = snapshots.navigating(refused_stage=4, time_ns=1)
        app.poll()
        await pilot.pause()
        assert isinstance(app.screen, GatesPage)
        text = app.text_of(GateTable)
        assert "before stage 4 patella" in text
        assert REASONS[1] in text
        await pilot.press("2")

    app = play(snapshots.navigating(), script)
    assert app.session.commands == [OverrideGate(4, REASONS[1])]


def test_in_a_mirror_its_check_belongs_to_the_time_out() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("t")
        assert Reason.MIRROR_UNCHECKED.value in app.text_of(GateTable)

    play(
        snapshots.navigating(has_mirror=True, mirror_reason=Reason.MIRROR_UNCHECKED),
        script, (140, 40),
    )  # fmt: skip


def test_after_the_last_stage_there_is_none() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("t")
        assert "before the operation's end" in app.text_of(GateTable)

    play(snapshots.navigating(stage=STAGES[-1], gate=()), script)
