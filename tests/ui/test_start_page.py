"""A box is drawn around the bone by keys or with the mouse, and searched in."""

from typing import Any

import numpy as np
import pytest
from textual import events
from textual.pilot import Pilot
from textual.strip import Strip

from navapp.control.commands import Register
from navapp.geometry.box import Box
from navapp.ui.pictures.fitting import find_point
from navapp.ui.pictures.halfblocks import compute_cell_codes, make_row_strip
from navapp.ui.start_page import BoxPicture, StartKeys, StartPage, draw_box, fit_into
from tests.ui import snapshots
from tests.ui.test_app import BellCounter, play

SIZE_PX = (1280, 720)
SIZES = pytest.mark.parametrize("size", [(80, 24), (160, 48)])


def ready(**changes: Any) -> Any:
    picture = np.full((720, 1280), 170, dtype=np.uint8)
    given = {"left_picture": picture, "picture_size_px": SIZE_PX}
    return snapshots.navigating(**{**given, **changes})


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
    corners: list[float] = []

    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b")
        app.poll()
        picture = app.screen.query_one(BoxPicture)
        columns, rows = picture.content_size
        begin, end = (columns // 3, rows // 4), (2 * columns // 3, 3 * rows // 4)
        await pilot.mouse_down(picture, offset=begin)
        await pilot.hover(picture, offset=(columns // 2, rows // 2))
        await pilot.hover(picture, offset=end)
        await pilot.mouse_up(picture, offset=end)
        seen = picture.as_seen(np.zeros((720, 1280), np.uint8)).shape
        room = columns, 2 * rows
        places = [find_point(seen, room, (x + 0.5, 2 * y + 1)) for x, y in (begin, end)]
        corners.extend((np.array(places) * SIZE_PX).ravel().tolist())
        await pilot.press("enter")

    x, y, width, height = given_box(play(ready(), script, size))
    assert (x, y, x + width, y + height) == pytest.approx(corners, abs=1)


@SIZES
def test_a_drag_out_of_the_picture_means_its_edge(size: tuple[int, int]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b")
        picture = app.screen.query_one(BoxPicture)
        columns, rows = picture.content_size
        await pilot.mouse_down(picture, offset=(columns // 2, rows // 2))
        picture.on_mouse_move(moved_to(picture, columns + 3, rows + 9))
        await pilot.pause()
        await pilot.press("enter")

    x, y, width, height = given_box(play(ready(), script, size))
    assert (x + width, y + height) == SIZE_PX
    assert x / 1280 == pytest.approx(0.5, abs=0.02)
    assert y / 720 == pytest.approx(0.5, abs=0.08)


def moved_to(picture: BoxPicture, x: int, y: int) -> events.MouseMove:
    return events.MouseMove(picture, x, y, 0, 0, 1, False, False, False)


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

    assert play(ready(has_eye=True, shows_eye=True), script).session.commands == []


def test_before_the_first_picture_nothing_is_searched_and_why_is_told() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b", "enter")
        assert "there is no picture yet" in app.text_of(StartKeys)
        assert app.n_bells == 1

    assert play(ready(left_picture=None), script).session.commands == []


def test_what_would_be_refused_is_told_before_anything_is_drawn() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b")
        assert "nothing can be searched now: rig moved" in app.text_of(StartKeys)

    play(ready(rig_alarm="rig moved"), script)


@SIZES
def test_no_words_are_cut(size: tuple[int, int]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b")
        keys = app.screen.query_one(StartKeys)
        assert not [line for line in str(keys.render()).splitlines() if len(line) > keys.size.width]

    play(ready(), script, size)


def test_x_searches_as_the_session_began() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("b", "x")
        await pilot.pause()

    (command,) = play(ready(), script).session.commands
    assert command.start.is_empty
    assert command.bone == "femur"


@pytest.mark.parametrize("ramp", ["", " .:-=+*#%@"])
@pytest.mark.parametrize("grey", [0, 90, 170, 255])
def test_the_box_is_seen_on_any_bone(grey: int, ramp: str) -> None:
    preview = np.full((90, 160, 3), grey, dtype=np.uint8)
    box = Box(320, 180, 640, 360)
    rows = [
        [make_row_strip(row, ramp) for row in compute_cell_codes(picture, 76, 18)]
        for picture in (preview, draw_box(preview, box, SIZE_PX))
    ]
    plain, drawn = ([cell_signs(strip) for strip in picture] for picture in rows)
    different = np.array(
        [[a != b for a, b in zip(*two, strict=True)] for two in zip(plain, drawn, strict=True)]
    )
    ys, xs = np.nonzero(different)
    # A frame of cells that differ, without a gap.
    assert different[ys.min() : ys.min() + 2, xs.min() : xs.max() + 1].any(axis=0).all()
    assert different[:, xs.min() : xs.min() + 2].any(axis=1)[ys.min() : ys.max() + 1].all()
    assert different[:, xs.max() - 1 : xs.max() + 1].any(axis=1)[ys.min() : ys.max() + 1].all()


def cell_signs(strip: Strip) -> list[tuple[str, object]]:
    """Character and style of every cell; without colour the character alone counts."""
    return [
        (sign, None if sign not in "▀ " else segment.style)
        for segment in strip
        for sign in segment.text
    ]


@pytest.mark.parametrize(
    ("box", "expected"),
    [
        (Box(-50, -50, 300, 300), Box(0, 0, 300, 300)),
        (Box(1200, 700, 300, 300), Box(980, 420, 300, 300)),
        (Box(100, 100, 3, 3), Box(100, 100, 80, 80)),
        (Box(0, 0, 5000, 5000), Box(0, 0, 1280, 720)),
    ],
)
def test_a_box_stays_in_the_picture_and_is_never_too_small(box: Box, expected: Any) -> None:
    assert fit_into(box, SIZE_PX) == expected


def test_a_box_is_drawn_where_it_is() -> None:
    preview = np.zeros((90, 160, 3), dtype=np.uint8)
    drawn = draw_box(preview, Box(320, 180, 640, 360), SIZE_PX)
    ys, xs = np.nonzero(drawn.any(axis=2))
    # A line of two pixels about the box's edge.
    assert (xs.min(), xs.max(), ys.min(), ys.max()) == (40, 119, 22, 67)
    assert not drawn[40, 60].any()
    assert not preview.any()
