"""Pages over the main screen."""

from typing import Any

from textual.pilot import Pilot

from navapp.ui.actions import ACTIONS
from navapp.ui.pages import KeyTable
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
