"""Pictures that the terminal paints, beside everything else that may lie over them."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np
import pytest
from textual.geometry import Region
from textual.pilot import Pilot

from navapp.control.states import Snapshot
from navapp.geometry.box import Box
from navapp.ui.app import NavigationApp
from navapp.ui.pictures.graphics import Graphics
from navapp.ui.pictures.painter import Painter
from navapp.ui.pictures.picture import Picture
from navapp.ui.pictures.picture_view import PictureView
from tests.ui import snapshots

CELL_PX = (10, 20)
LARGE = snapshots.picture(0.0, 720, 1280)


class Canvas(Painter):
    """Notes what would be painted."""

    def __init__(self) -> None:
        self.cell_px = CELL_PX
        self.shown: dict[int, tuple[np.ndarray, Region]] = {}
        self.is_full = False
        self.n_busy = 0  # so many times the last picture is not through yet

    @property
    def has_pixels(self) -> bool:
        return True

    def find_place(self, region: Region) -> Region:
        return region

    def paint(self, number: int, picture: np.ndarray, place: Region) -> bool:
        if self.is_full:
            raise OSError("no room")
        if self.n_busy:
            self.n_busy -= 1
            return False
        self.shown[number] = picture, place
        return True

    def erase(self, number: int) -> None:
        self.shown.pop(number, None)

    def close(self) -> None:
        pass


Script = Callable[["PaintedApp", Pilot[Any]], Awaitable[None]]


class PaintedApp(NavigationApp):
    """In a terminal that paints."""

    def __init__(self, snapshot: Snapshot) -> None:
        self.session, self.canvas = snapshots.ScriptedSession(snapshot), Canvas()
        super().__init__(self.session, polls_per_s=0, graphics=Graphics())
        self.painter = self.canvas

    def show(self, **changes: Any) -> None:
        self.session.current = snapshots.navigating(**{"picture": LARGE.copy(), **changes})
        self.poll()

    @property
    def painted(self) -> list[tuple[np.ndarray, Region]]:
        return list(self.canvas.shown.values())

    def lines(self) -> str:
        """What the main picture's cells hold."""
        view = self.screen_stack[0].query_one(PictureView)
        return "".join(view.render_line(y).text for y in range(view.content_size.height))


def play(script: Script, size: tuple[int, int] = (160, 48), **changes: Any) -> None:
    async def run() -> None:
        snapshot = snapshots.navigating(**{"picture": LARGE, **changes})
        app = PaintedApp(snapshot)
        async with app.run_test(size=size, notifications=True) as pilot:
            await pilot.pause()
            await script(app, pilot)

    asyncio.run(run())


def test_the_picture_is_painted_over_blank_cells() -> None:
    async def script(app: PaintedApp, _pilot: Pilot[Any]) -> None:
        ((picture, place),) = app.painted
        np.testing.assert_array_equal(picture, LARGE)
        assert place == app.screen.query_one(PictureView).content_region
        assert app.lines().strip() == ""

    play(script)


def test_a_page_takes_the_picture_away_and_gives_it_back() -> None:
    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        await pilot.press("d")
        app.show()
        assert app.painted == []
        await pilot.press("escape")
        app.show()
        await pilot.pause()
        assert len(app.painted) == 1
        assert app.lines().strip() == ""

    play(script)


def test_a_message_over_it_is_read_on_half_blocks() -> None:
    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        app.notify("\n".join(["several", "lines"] * 4), timeout=60.0)
        await pilot.pause()
        app.show()
        await pilot.pause()
        assert app.painted == []
        assert app.lines().strip()
        app.clear_notifications()
        await pilot.pause()
        app.show()
        await pilot.pause()
        assert len(app.painted) == 1

    play(script, (80, 24))


def test_without_room_for_pixels_half_blocks_are_shown() -> None:
    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        app.canvas.is_full = True
        app.show()
        await pilot.pause()
        assert app.painter is None
        assert app.lines().strip()

    play(script)


def test_a_key_shows_the_region_around_the_bone_and_all_of_it_again() -> None:
    box = Box(500, 200, 200, 150)

    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        assert app.painted[0][0].shape == LARGE.shape
        await pilot.press("w")
        await pilot.pause()
        height, width = app.painted[0][0].shape[:2]
        assert 200 < width < 640
        place = app.painted[0][1]
        aspect = place.width * CELL_PX[0] / (place.height * CELL_PX[1])
        assert width / height == pytest.approx(aspect, rel=0.01)
        await pilot.press("w")
        await pilot.pause()
        assert app.painted[0][0].shape == LARGE.shape

    play(script, bone_box=box, picture_size_px=(1280, 720))


def test_a_page_of_pictures_paints_them_and_takes_them_away() -> None:
    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        await pilot.press("p")
        app.show(**given)
        await pilot.pause()
        whole, magnifier = (picture for picture, _ in app.painted)
        widgets = {widget.id: widget for widget in app.screen.query(Picture)}
        assert whole.shape[1] <= widgets["whole"].room[0]
        # A pixel of the camera's picture is a square of several.
        assert (np.diff(magnifier[:, :6].astype(int), axis=1) == 0).all()
        await pilot.press("escape")
        await pilot.pause()
        app.show(**given)
        await pilot.pause()
        assert len(app.painted) == 1

    given = {
        "left_picture": np.random.default_rng(1).integers(0, 256, (720, 1280), dtype=np.uint8),
        "picture_size_px": (1280, 720),
        "landmarks": {f"femur/{name}": np.zeros(3) for name in "abc"},
    }
    play(script, **given)


def test_half_blocks_show_the_region_around_the_bone_and_say_so() -> None:
    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        app.painter = None
        app.show(bone_box=Box(500, 200, 200, 150), picture_size_px=(1280, 720))
        await pilot.pause()
        view = app.screen.query_one(PictureView)
        assert "around the bone" in str(view.border_title)
        await pilot.press("w")
        assert "around the bone" not in str(view.border_title)

    play(script)


@pytest.mark.parametrize(("size", "is_shown"), [((160, 48), True), ((80, 24), False)])
def test_residuals_lie_beside_a_candidate_where_there_is_room(
    size: tuple[int, int], is_shown: bool
) -> None:
    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        app.session.current = snapshots.review(picture=LARGE, residual_picture=LARGE[:300, :300])
        app.poll()
        await pilot.pause()
        app.poll()
        await pilot.pause()
        assert len(app.painted) == 1 + is_shown
        app.show()
        await pilot.pause()
        app.show()
        await pilot.pause()
        assert len(app.painted) == 1

    play(script, size)


def test_what_a_busy_terminal_has_not_taken_comes_as_soon_as_it_can() -> None:
    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        app.canvas.n_busy = 3
        plain = np.zeros_like(LARGE)
        app.show(picture=plain)
        np.testing.assert_array_equal(app.painted[0][0], LARGE)
        # No further poll: what was guided must not stay.
        await pilot.pause(0.5)
        np.testing.assert_array_equal(app.painted[0][0], plain)

    play(script)


def test_cells_that_are_written_anew_are_painted_anew() -> None:
    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        app.canvas.shown.clear()
        app.screen.refresh()
        await pilot.pause(0.3)
        assert len(app.painted) == 1

    play(script)


def test_a_place_is_told_within_a_picture_that_does_not_fill_its_room() -> None:
    async def script(app: PaintedApp, pilot: Pilot[Any]) -> None:
        view = app.screen.query_one(PictureView)
        content = view.content_region
        width, height = content.width // 2, content.height // 2
        x, y = content.x + content.width // 4, content.y + content.height // 4
        view._place = Region(x, y, width, height)
        middle = view.find_point(content.width // 4 + width // 2, content.height // 4 + height // 2)
        assert middle == pytest.approx((0.5, 0.5), abs=0.05)
        assert view.find_point(0, 0) == (0.0, 0.0)

    play(script)
