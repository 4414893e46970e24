"""Pictures of the screen; look at a difference, then accept it: --release --snapshot-update."""

import asyncio
import dataclasses
from collections.abc import Callable
from typing import Any

import pytest
from textual.content import Content
from textual.pilot import Pilot

from navapp.control.stages import STAGES
from navapp.control.states import Snapshot
from navapp.ui.app import NavigationApp
from navapp.ui.page_keys import PageKeys
from navapp.ui.pictures.picture_view import PictureView
from navapp.ui.pose_panel import PosePanel
from navapp.ui.symbols import ASCII
from tests.ui import snapshots
from tests.ui.terminals import SIZES
from tests.ui.test_app import BellCounter, play
from tests.ui.test_steps_page import STEPS
from tests.ui.test_tools_page import a_snapshot as with_tools

STATES: dict[str, tuple[Callable[[], Snapshot], str, str]] = {
    "navigating": (snapshots.navigating, "NAVIGABLE  yes", "left view"),
    "suspended": (snapshots.suspended, "NAVIGABLE  NO", "left view · NO GUIDES"),
    "review": (snapshots.review, "judged OK", "left view · CANDIDATE, not accepted"),
    "compared": (snapshots.compared, "arrows: compare", "left view · CANDIDATE, not accepted"),
    "starting": (snapshots.starting, "NAVIGABLE  NO", "left view · NO GUIDES"),
    "blanked": (snapshots.blanked, "NAVIGABLE  NO", "left view · BLANKED, the display is dark"),
}


@SIZES
@pytest.mark.parametrize("state", list(STATES))
def test_screen(state: str, size: tuple[int, int], snap_compare: Callable[..., bool]) -> None:
    make, words, title = STATES[state]
    app = NavigationApp(snapshots.ScriptedSession(make()), polls_per_s=0)

    async def look(pilot: Pilot[Any]) -> None:
        await pilot.pause()
        assert words in str(pilot.app.screen.query_one(PosePanel).render())
        assert pilot.app.screen.query_one(PictureView).border_title == title

    assert snap_compare(app, terminal_size=size, run_before=look)


def test_the_key_to_the_colours_of_the_depth(snap_compare: Callable[..., bool]) -> None:
    shown = dataclasses.replace(snapshots.navigating(), shows_depth=True)
    app = NavigationApp(snapshots.ScriptedSession(shown), polls_per_s=0)

    async def look(pilot: Pilot[Any]) -> None:
        await pilot.pause()
        title = Content.from_markup(pilot.app.screen.query_one(PictureView).border_title)
        assert title.plain == "left view · matched border interior mismatch unknown"

    assert snap_compare(app, run_before=look)


def test_the_picture_of_the_eye_says_so_and_the_frame_how_to_see_it() -> None:
    shown = dataclasses.replace(snapshots.navigating(), has_eye=True, shows_eye=True)

    async def run() -> None:
        app = NavigationApp(snapshots.ScriptedSession(shown), polls_per_s=0)
        async with app.run_test() as pilot:
            await pilot.pause()
            picture = pilot.app.screen.query_one(PictureView)
            assert str(picture.border_title) == "SIMULATED EYE in the mirror"
            assert str(picture.border_subtitle).startswith("y: video, or what the eye sees")
            assert "not for clinical use" in str(picture.border_subtitle)

    asyncio.run(run())


def test_plain_terminal(snap_compare: Callable[..., bool]) -> None:
    session = snapshots.ScriptedSession(snapshots.suspended())
    assert snap_compare(NavigationApp(session, symbols=ASCII, polls_per_s=0))


PAGES = {
    "help": "question_mark",
    "devices": "d",
    "layers": "l",
    "quit": "q",
    "steps": "k",
    "gates": "t",
    "events": "e",
    "tools": "u",
    "box": "b",
    "picks": "p",
    "palette": "ctrl+p",
}


@SIZES
@pytest.mark.parametrize("page", list(PAGES))
def test_page(page: str, size: tuple[int, int], snap_compare: Callable[..., bool]) -> None:
    stage = STAGES[2]
    shown = with_tools(
        stage=stage,
        layers=stage.layers,
        steps=STEPS,
        left_picture=snapshots.picture(1.0, 180, 320),
        picture_size_px=(320, 180),
    )
    app = NavigationApp(snapshots.ScriptedSession(shown), polls_per_s=0)
    assert snap_compare(app, press=[PAGES[page]], terminal_size=size)


@pytest.mark.parametrize("page", [one for one in PAGES if one not in ("quit", "palette")])
def test_the_keys_of_a_page_are_not_cut_on_the_smallest_terminal(page: str) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press(PAGES[page])
        await pilot.pause()
        assert len(app.text_of(PageKeys)) <= 80

    play(with_tools(), script, (80, 24))
