"""A box is drawn around the bone by keys or with the mouse, and searched in."""

from typing import Any

import numpy as np
import pytest
from textual.pilot import Pilot

from navapp.control.commands import Register
from navapp.ui.start_page import BoxPicture, StartBox, StartKeys, StartPage
from tests.ui import snapshots
from tests.ui.test_app import BellCounter, play

SIZE_PX = (1280, 720)
SIZES = pytest.mark.parametrize("size", [(80, 24), (160, 48), (200, 60)])


def ready(**changes: Any) -> Any:
    return snapshots.navigating(picture_size_px=SIZE_PX, **changes)


def given_box(app: BellCounter) -> tuple[int, int, int, int]:
    """Of the one registration that was asked for."""
    (command,) = app.session.commands
    assert isinstance(command, Register)
    assert command.start is not None
    assert command.start.box is not None
    return command.start.box


@SIZES
def test_a_box_is_moved_and_sized_by_keys_and_searched_in(size: tuple[int, int]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b", "right", "right", "down", "shift+left", "shift+up")
        assert "608 x 392 px at 368, 180" in app.text_of(StartKeys)
        assert "femur" in app.text_of(StartKeys)
        await pilot.press("enter")
        await pilot.pause()
        assert not isinstance(app.screen, StartPage)

    assert given_box(play(ready(), script, size)) == (368, 180, 608, 392)


@SIZES
def test_the_mouse_draws_the_box_that_it_spans(size: tuple[int, int]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b")
        picture = app.screen.query_one(BoxPicture)
        columns, rows = picture.content_size
        begin, end = (columns // 3, rows // 4), (2 * columns // 3, 3 * rows // 4)
        await pilot.mouse_down(picture, offset=begin)
        await pilot.hover(picture, offset=(columns // 2, rows // 2))
        await pilot.hover(picture, offset=end)
        await pilot.mouse_up(picture, offset=end)
        await pilot.press("enter")

    x, y, width, height = given_box(play(ready(), script, size))
    # Black beside the picture belongs to no part of it: the larger half of a wide screen.
    assert 0.1 < x / 1280 < 0.4
    assert 0.6 < (x + width) / 1280 < 0.9
    assert y / 720 == pytest.approx(0.25, abs=0.08)
    assert (y + height) / 720 == pytest.approx(0.75, abs=0.08)


def test_the_next_box_begins_as_the_last_one_was_drawn() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b", "right", "enter")
        await pilot.pause()
        await pilot.press("b", "enter")
        await pilot.pause()

    boxes = [command.start.box for command in play(ready(), script).session.commands]
    assert boxes == [(336, 180, 640, 360)] * 2


def test_leaving_searches_nothing() -> None:
    async def leave(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b", "right", "escape")
        await pilot.pause()
        assert not isinstance(app.screen, StartPage)

    assert play(ready(), leave).session.commands == []


def test_while_the_eye_is_shown_there_is_nothing_to_draw_on() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b")
        assert "press y" in app.text_of(StartKeys)

    play(ready(has_eye=True, shows_eye=True), script)


@pytest.mark.parametrize(
    ("box", "expected"),
    [
        (StartBox(-50, -50, 300, 300), StartBox(0, 0, 300, 300)),
        (StartBox(1200, 700, 300, 300), StartBox(980, 420, 300, 300)),
        (StartBox(100, 100, 3, 3), StartBox(100, 100, 80, 80)),
        (StartBox(0, 0, 5000, 5000), StartBox(0, 0, 1280, 720)),
    ],
)
def test_a_box_stays_in_the_picture_and_is_never_too_small(box: StartBox, expected: Any) -> None:
    assert box.within(SIZE_PX) == expected


def test_a_box_is_drawn_where_it_is() -> None:
    preview = np.zeros((90, 160, 3), dtype=np.uint8)
    drawn = StartBox(320, 180, 640, 360).draw(preview, SIZE_PX)
    ys, xs = np.nonzero(drawn.any(axis=2))
    assert (xs.min(), xs.max(), ys.min(), ys.max()) == (40, 119, 22, 67)
    assert not drawn[40, 60].any()
    assert not preview.any()
