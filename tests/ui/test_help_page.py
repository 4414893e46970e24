"""The help."""

import re
from typing import Any

import pytest
from textual.pilot import Pilot

from navapp.control.states import SessionState
from navapp.ui.actions import ACTIONS
from navapp.ui.help_page import KeyTable, WordTable
from navapp.ui.line_panel import LinePanel
from navapp.ui.pose_panel import PosePanel
from navapp.ui.words import WORDS
from navapp.values import Status
from tests.ui import snapshots
from tests.ui.test_app import BellCounter, play


def test_the_help_page_has_every_key_and_cuts_no_words() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("question_mark")
        await pilot.pause()
        table = app.screen.query_one(KeyTable)
        lines = str(table.render()).splitlines()
        assert not [line for line in lines if len(line) > table.size.width]
        for action in ACTIONS:
            if not action.name.startswith(("stage-", "nudge-")):
                assert any(action.description in line for line in lines), action.name
        assert "find a command" in str(table.render())

    play(snapshots.starting(), script, (80, 24))


@pytest.mark.parametrize("size", [(80, 24), (160, 48), (200, 60)])
def test_every_word_is_explained_without_being_cut(size: tuple[int, int]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("question_mark")
        await pilot.pause()
        table = app.screen.query_one(WordTable)
        lines = str(table.render()).splitlines()
        assert len(lines) == table.size.height
        assert not [line for line in lines if len(line) > table.size.width]
        text = " ".join(" ".join(lines).split())
        for word, meaning in WORDS:
            assert f"{word} {meaning.split()[0]}" in text

    play(snapshots.navigating(), script, size)


def test_the_names_of_states_verdicts_and_figures_are_explained() -> None:
    explained = {word for word, _ in WORDS}
    states = {state.name for state in SessionState}
    assert states <= explained
    assert {Status.DEGRADED.value, Status.LOST.value, "judged OK"} <= explained

    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.pause()
        for panel in (PosePanel, LinePanel):
            for name in re.findall(r"(?m)^ *([a-z]{2,})\b|\d ([a-z]{2,})\b", app.text_of(panel)):
                word = name[0] or name[1]
                assert word in explained | {"mm", "accept", "reject", "skew"}, word

    for snapshot in (snapshots.navigating(), snapshots.review()):
        play(snapshot, script, (160, 48))
