"""The live screens with the tutorial's lines."""

import asyncio
from typing import Any

import pytest

from navapp.control.stages import STAGES
from navapp.control.states import SessionState, Snapshot
from navapp.ui.capture.panels import InstructionLines
from navapp.ui.symbols import UNICODE
from navapp.ui.tutorial.apps import TutorialApp, TutorialCaptureApp
from navapp.ui.tutorial.guide import Guide
from navapp.ui.tutorial.lines import TutorialCaptureLines, TutorialLines, format_guide
from navapp.ui.tutorial.tasks import make_capture_guide, make_navigation_guide, make_room_guide
from navapp.values import Reason
from tests.ui import snapshots
from tests.ui.tutorial.test_tasks import capture

READY = snapshots.navigating(
    stage=STAGES[0],
    state=SessionState.READY,
    reasons=(Reason.NOT_NAVIGATING,),
    time_out=(snapshots.condition("patient", "this is the plan's patient"),),
)


class FixedCapture:
    is_over = False

    def snapshot(self) -> Any:
        return capture(5, is_following=True)

    def submit(self, command: Any) -> None:
        raise AssertionError(command)


def test_the_lines_tell_what_to_do_and_tick_what_is_reached() -> None:
    guide = make_room_guide()
    session = snapshots.ScriptedSession(READY)
    app = TutorialApp(guide, session, "navapp", polls_per_s=0)

    async def run() -> list[str]:
        async with app.run_test(size=(100, 30)) as pilot:
            await pilot.pause()
            told = []
            for snapshot in (READY, snapshots.navigating(time_ns=READY.time_ns + 1)):
                session.current = snapshot
                for _ in range(3):
                    app.poll()
                told.append(str(app.screen.query_one(TutorialLines).render()))
            return told

    first, then = asyncio.run(run())
    assert "Press g" in first
    assert "●–" in first  # noqa: RUF001 (marks of the screen)
    assert "Press SPACE" in then
    assert "the time-out is done" in then


def test_the_capture_has_them_too() -> None:
    guide = make_capture_guide()
    app = TutorialCaptureApp(guide, FixedCapture(), symbols=UNICODE, polls_per_s=0)

    async def run() -> tuple[str, int]:
        async with app.run_test(size=(80, 24)) as pilot:
            await pilot.pause()
            app.poll()
            lines = app.screen.query_one(TutorialCaptureLines)
            wish = app.screen.query_one(InstructionLines)
            return str(lines.render()), wish.region.y - lines.region.y

    text, below = asyncio.run(run())
    assert "Wait for ENOUGH" in text
    assert below > 3, "the lines stand above the pictures"


@pytest.mark.parametrize("make", [make_room_guide, make_capture_guide, make_navigation_guide])
def test_every_text_fits_into_eighty_columns(make: Any) -> None:
    guide = make()
    assert_fits(guide)


def assert_fits(guide: Guide[Snapshot]) -> None:
    for task in guide._tasks:
        one = Guide((task,), task.text)
        lines = [str(line) for line in format_guide(one, 80, UNICODE)]
        told = " ".join(" ".join(line[10:].split()) for line in lines[1:])
        assert task.text == told.strip()
