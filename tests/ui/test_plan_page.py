"""The page on which a plan is checked by eye."""

import asyncio
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from textual.pilot import Pilot
from textual.widgets import Static

from navapp.preop import PlanView
from navapp.ui.app import NavigationApp
from navapp.ui.main_screen import MainScreen
from navapp.ui.plan_page import PlanPage, SlicePicture
from navapp.ui.plan_texts import PlanFacts, SliceText
from tests.ui import plans, snapshots
from tests.ui.terminals import SIZES
from tests.ui.test_app import Script


def make_app(plan: PlanView | None) -> NavigationApp:
    session = snapshots.ScriptedSession(snapshots.navigating())
    return NavigationApp(session, polls_per_s=0, plan=plan)


def play(plan: PlanView | None, script: Script, size: tuple[int, int] = (80, 24)) -> NavigationApp:
    app = make_app(plan)

    async def run() -> None:
        async with app.run_test(size=size) as pilot:
            await script(app, pilot)

    asyncio.run(run())
    return app


def text_of(app: NavigationApp, kind: type[Any] = SliceText) -> str:
    return str(app.screen.query_one(kind).render())


def marks_of(app: NavigationApp) -> list[str]:
    sides = ("left", "right", "top", "bottom")
    return [str(app.screen.query_one(f"#plan-{side}", Static).content) for side in sides]


@SIZES
@pytest.mark.parametrize("kind", ["ct", "surfaces"])
def test_picture(kind: str, size: tuple[int, int], snap_compare: Callable[..., bool]) -> None:
    app = make_app(plans.with_ct() if kind == "ct" else plans.without_ct())

    async def look(pilot: Pilot[Any]) -> None:
        await pilot.press("i", "n")
        await pilot.pause()
        assert "femur/notch" in text_of(app)
        assert ("contours alone" in " ".join(text_of(app).split())) == (kind == "surfaces")

    assert snap_compare(app, terminal_size=size, run_before=look)


@SIZES
def test_picture_of_the_facts(size: tuple[int, int], snap_compare: Callable[..., bool]) -> None:
    assert snap_compare(make_app(plans.with_ct()), press=["i", "f"], terminal_size=size)


def test_the_slice_s_place_is_told_and_arrows_go_on() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i")
        await pilot.pause()
        assert "axial, z = 0.0 mm LPS" in text_of(app)
        assert marks_of(app) == ["R", "L", "A", "P"]
        for keys, at in (("up", 1), ("right", 2), ("down", 1), ("left", 0), ("shift+up", 10),
                         ("shift+left", 0), ("pageup", 10), ("pagedown", 0)):  # fmt: skip
            await pilot.press(keys)
            assert f"z = {at:.1f} mm LPS" in text_of(app), keys

    app = play(plans.with_ct(), script)
    # The arrows move no cross of the mirror meanwhile.
    assert app._session.commands == []


def test_directions_are_chosen_by_numbers_and_with_tab() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i", "3")
        assert "sagittal, x = 0.0" in text_of(app)
        assert marks_of(app) == ["A", "P", "H", "F"]
        await pilot.press("shift+tab")
        assert "coronal, y = 0.0" in text_of(app)
        assert marks_of(app) == ["R", "L", "H", "F"]
        await pilot.press("tab", "tab")
        assert "axial" in text_of(app)
        await pilot.press("2")
        assert "coronal" in text_of(app)

    assert play(plans.with_ct(), script)._session.commands == []


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_landmark_is_drawn_at_its_side_of_the_picture(
    number: int,
) -> None:
    """It lies to the right, in front and towards the head: always at the upper left."""

    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i", str(number))
        # Of the three points the one that is the landmark's.
        for _ in range(4):
            await pilot.press("n")
            if "femur/notch" in text_of(app):
                break
        picture = app.screen.query_one(SlicePicture)._picture
        blue, green, red = np.moveaxis(picture.astype(int), 2, 0)
        is_cross = (red > 200) & (green > 200) & (blue < 130)
        rows, columns = np.nonzero(is_cross)
        assert len(rows) > 5
        assert rows.mean() < picture.shape[0] / 2
        assert columns.mean() < picture.shape[1] / 2

    play(plans.with_ct(), script, (160, 48))


def test_air_to_the_patient_s_left_is_at_the_right_of_the_axial_slice() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i")
        await pilot.pause()
        picture = app.screen.query_one(SlicePicture)._picture
        width = picture.shape[1]
        assert picture[5, : width // 2].min() > 40
        assert picture[5, -width // 10 :].max() == 0

    play(plans.with_ct(), script)


def test_the_densities_of_soft_tissue_are_brighter() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i")
        await pilot.pause()
        before = app.screen.query_one(SlicePicture)._picture[5, 5].mean()
        assert "-200 to 1400 HU" in text_of(app)
        await pilot.press("w")
        assert "-150 to 250 HU" in text_of(app)
        assert app.screen.query_one(SlicePicture)._picture[5, 5].mean() > before + 50

    play(plans.with_ct(), script)


def test_surfaces_alone_are_contours_on_black_in_words_too() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i")
        await pilot.pause()
        assert "Made from surfaces, without a CT" in " ".join(text_of(app).split())
        assert "HU" not in text_of(app)
        picture = app.screen.query_one(SlicePicture)._picture
        assert (picture == 0).all(axis=2).mean() > 0.8
        assert (picture[..., 2] > 100).any()
        await pilot.press("w")
        assert "HU" not in text_of(app)

    play(plans.without_ct(), script)


def test_facts_hold_warnings_bones_and_where_the_plan_comes_from() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i")
        await pilot.pause()
        assert "1 warning of the plan: f" in text_of(app)
        await pilot.press("f")
        await pilot.pause()
        text = text_of(app, PlanFacts)
        plan = plans.make_plan()
        volume = f"{plan.bones['femur'].mesh.volume_mm3() / 1000.0:.1f} cm3"
        for words in (plan.digest, "small knee", *plans.WARNINGS, "300 x 300 x 200", "femur",
                      "tibia", volume, "32 x 32 x 32 mm", "right", "mean 2.0"):  # fmt: skip
            assert words in text, words
        scroll = app.screen.query_one("#plan-facts")
        assert scroll.scroll_y == 0
        await pilot.press("down", "down")
        await pilot.pause()
        assert scroll.scroll_y == 2
        await pilot.press("f")
        await pilot.pause()
        assert "z = 0.0 mm" in text_of(app)

    play(plans.with_ct(), script)


@SIZES
def test_no_text_is_cut(size: tuple[int, int]) -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i", "n")
        await pilot.pause()
        widths = {kind: app.screen.query_one(kind).content_size.width for kind in (SliceText,)}
        for line in text_of(app).splitlines():
            assert len(line) <= widths[SliceText]
        assert "…" not in text_of(app)
        assert len(PlanPage.keys) + len(" SPACE blank  ESC") <= 80
        await pilot.press("f")
        await pilot.pause()
        facts = app.screen.query_one(PlanFacts)
        lines = str(facts._shown).splitlines()  # as it stands on the screen
        assert len(lines) == facts.size.height
        assert max(map(len, lines)) <= facts.content_size.width
        # And none is broken that has room.
        assert "300 x 300 x 200 of 0.5 x 0.5 x 0.8 mm" in str(facts._shown)

    play(plans.with_ct(), script, size)


def test_a_slice_is_drawn_once_and_again_only_when_it_changes() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i")
        await pilot.pause()
        picture = app.screen.query_one(SlicePicture)._picture
        for _ in range(5):
            app.poll()
        assert app.screen.query_one(SlicePicture)._picture is picture
        await pilot.press("up")
        assert app.screen.query_one(SlicePicture)._picture is not picture

    play(plans.with_ct(), script)


def test_the_page_opens_again_where_it_was_left() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i", "2", "up", "i")
        await pilot.pause()
        assert isinstance(app.screen, MainScreen)
        await pilot.press("i")
        await pilot.pause()
        assert "coronal, y = 1.0" in text_of(app)
        await pilot.press("escape")
        await pilot.pause()
        assert isinstance(app.screen, MainScreen)

    play(plans.with_ct(), script)


def test_space_blanks_the_display_from_here_too() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i", "space")

    assert len(play(plans.with_ct(), script)._session.commands) == 1


def test_without_a_plan_at_hand_it_is_said() -> None:
    async def script(app: NavigationApp, pilot: Pilot[Any]) -> None:
        await pilot.press("i")
        await pilot.pause()
        assert isinstance(app.screen, MainScreen)
        assert any("not at hand" in note.message for note in app._notifications)

    play(None, script)
