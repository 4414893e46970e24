"""Landmarks are picked to the pixel, by keys or with the mouse, and searched from."""

from typing import Any

import numpy as np
import pytest
from textual.pilot import Pilot

from navapp.control.commands import Register
from navapp.ui.picks_page import PickList, PicksPage, PlacePicture, draw_places, magnify
from tests.ui import snapshots
from tests.ui.test_app import BellCounter, play

SIZE_PX = (1280, 720)
MARKS = {f"femur/{name}": np.full(3, float(k)) for k, name in enumerate(("notch", "a", "b", "c"))}
SIZES = pytest.mark.parametrize("size", [(80, 24), (160, 48)])


def ready(**changes: Any) -> Any:
    picture = np.zeros((720, 1280, 3), dtype=np.uint8)
    given = {"left_picture": picture, "picture_size_px": SIZE_PX, "landmarks": MARKS}
    return snapshots.navigating(**{**given, **changes})


def given_picks(app: BellCounter) -> dict[str, tuple[float, float]]:
    """Of the one registration that was asked for."""
    (command,) = app.session.commands
    assert isinstance(command, Register)
    assert command.start is not None
    for pick in command.start.picks:
        assert pick.bone == "femur"
        np.testing.assert_array_equal(pick.model_mm, MARKS[pick.name])
    return {pick.name: pick.left_px for pick in command.start.picks}


@SIZES
def test_landmarks_are_picked_by_keys_and_searched_from(size: tuple[int, int]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("p", "right", "down", "down", "enter")
        assert "641, 362" in app.text_of(PickList)
        await pilot.press("shift+left", "enter", "g")
        await pilot.pause()
        # Two are too few.
        assert isinstance(app.screen, PicksPage)
        assert app.n_bells == 1
        await pilot.press("shift+up", "enter", "g")
        await pilot.pause()
        assert not isinstance(app.screen, PicksPage)

    picks = given_picks(play(ready(), script, size))
    expected = [(641.0, 362.0), (621.0, 362.0), (621.0, 342.0)]
    assert picks == dict(zip(MARKS, expected, strict=False))


def test_a_pick_can_be_forgotten_and_the_selection_walks_both_ways() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("p", "enter", "shift+tab", "x", "n", "n")  # a is left out
        await pilot.press("shift+left", "enter", "shift+left", "enter", "shift+left", "enter", "g")
        await pilot.pause()

    picks = given_picks(play(ready(), script))
    # Each goes on to the next that has no place.
    assert picks == {
        "femur/b": (620.0, 360.0), "femur/c": (600.0, 360.0), "femur/notch": (580.0, 360.0)
    }  # fmt: skip


def test_landmarks_at_one_place_are_refused_by_name() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("p", "enter", "right", "enter", "shift+left", "enter", "g")
        await pilot.pause()
        assert isinstance(app.screen, PicksPage)
        assert app.n_bells == 1

    assert play(ready(), script).session.commands == []


def test_another_bone_with_fewer_landmarks_may_come_meanwhile() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("p", "n", "n", "n")
        app.session.current = ready(landmarks={"patella/centre": np.zeros(3)})
        app.poll_until_text()
        await pilot.press("enter", "x", "n", "g")
        await pilot.pause()
        assert "the plan has 1 landmarks" in app.text_of(PickList)

    assert play(ready(), script).session.commands == []


@pytest.mark.parametrize("changes", [{"shows_eye": True, "has_eye": True}, {"left_picture": None}])
def test_without_the_video_nothing_is_picked(changes: dict[str, Any]) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("p", "enter", "shift+left", "enter", "shift+up", "enter", "g")
        await pilot.pause()
        text = app.text_of(PickList)
        assert "press y" in text or "no picture yet" in text

    assert play(ready(**changes), script).session.commands == []


@SIZES
def test_a_click_moves_the_cursor_coarsely_and_in_the_magnifier_to_the_pixel(
    size: tuple[int, int],
) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("p")
        whole = app.screen.query_one("#whole", PlacePicture)
        columns, rows = whole.content_size
        await pilot.click(whole, offset=(columns // 4, rows // 2))
        await pilot.pause()
        x, y = cursor(app)
        assert x / 1280 == pytest.approx(0.25, abs=0.03)
        assert y / 720 == pytest.approx(0.5, abs=0.1)  # a row of the small picture
        magnifier = app.screen.query_one("#magnifier", PlacePicture)
        columns, rows = magnifier.content_size
        await pilot.click(magnifier, offset=(columns // 2 + 5, rows // 2 + 2))
        await pilot.pause()
        assert cursor(app)[0] == x + 5
        assert cursor(app)[1] - y in (3, 4, 5)

    play(ready(), script, size)


def cursor(app: BellCounter) -> tuple[int, int]:
    x, y = app.text_of(PickList).splitlines()[0].rpartition("cursor ")[2].split(", ")
    return int(x), int(y)


def test_picks_stay_until_the_next_time_and_leaving_searches_nothing() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("p", "enter", "escape")
        await pilot.pause()
        await pilot.press("p")
        assert "1 picked" in app.text_of(PickList)

    assert play(ready(), script).session.commands == []


def test_without_landmarks_a_box_is_offered() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("p", "enter", "n", "x")
        assert "draw a box" in app.text_of(PickList)

    play(ready(landmarks={}), script)


def test_the_magnifier_shows_the_pixels_as_they_are() -> None:
    picture = np.random.default_rng(3).integers(0, 255, (720, 1280), dtype=np.uint8)
    shown = magnify(picture, (100, 50), (41, 31), {"a": (101, 51)})
    assert shown[15, 20].tolist() == [picture[50, 100]] * 3
    assert shown[0, 0].tolist() == [picture[50 - 15, 100 - 20]] * 3
    assert shown[16, 21].tolist() == [0, 255, 0]
    assert not shown[16, 20].any()
    corner = magnify(picture, (0, 0), (41, 31), {})
    assert not corner[:15, :14].any()
    assert corner[15, 20].tolist() == [picture[0, 0]] * 3
    end = magnify(picture, (1279, 719), (41, 31), {})
    assert end[15, 20].tolist() == [picture[719, 1279]] * 3
    assert not end[17:, 40].any()


def test_places_are_drawn_where_they_are() -> None:
    preview = np.zeros((90, 160, 3), dtype=np.uint8)
    drawn = draw_places(preview, SIZE_PX, (640, 360), {"a": (80, 80)})
    assert drawn[45, 10].tolist() == drawn[10, 80].tolist() == [0, 255, 255]
    assert not drawn[45, 80].any()
    assert drawn[10, 10].tolist() == [0, 255, 0]
    assert drawn[46, 10].tolist() == drawn[10, 8].tolist() == [0, 0, 0]
    assert not preview.any()
