import asyncio
import dataclasses
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from textual.pilot import Pilot
from textual.widgets import Static

from navapp.control.commands import (
    Accept,
    Blank,
    Cancel,
    CheckMirror,
    ChooseCandidate,
    Command,
    ConfirmCross,
    EnterStage,
    NudgeCross,
    Quit,
    Reconnect,
    Register,
    Reject,
    Show,
    ToggleDepth,
    ToggleEye,
)
from navapp.control.stages import STAGES
from navapp.control.states import (
    CrossCheck,
    Event,
    EventLevel,
    SessionState,
    Snapshot,
)
from navapp.ui.app import POLLS_PER_S, POLLS_PER_TEXT, SILENT_AFTER_POLLS, NavigationApp
from navapp.ui.help_page import HelpPage
from navapp.ui.layers_page import LayersPage
from navapp.ui.main_screen import MainScreen, SmallNotice
from navapp.ui.pages import DevicesPage, EventsPage, QuitQuestion
from navapp.ui.pictures.blocks import CELL_PX, BlockEncoder
from navapp.ui.pictures.graphics import Graphics
from navapp.ui.pictures.picture_view import CandidateView, PictureView
from navapp.ui.pose_panel import PosePanel
from navapp.ui.symbols import UNICODE
from tests.ui import snapshots

Script = Callable[["BellCounter", Pilot[Any]], Awaitable[None]]


class BellCounter(NavigationApp):
    """Counts instead of ringing; polls only when told to."""

    def __init__(self, snapshot: Snapshot) -> None:
        self.session = snapshots.ScriptedSession(snapshot)
        self.n_bells = 0
        super().__init__(self.session, polls_per_s=0)

    def bell(self) -> None:
        self.n_bells += 1

    def poll_until_text(self) -> None:
        """Until text that has changed is shown for sure."""
        for _ in range(POLLS_PER_TEXT):
            self.poll()

    def text_of(self, selector: type[Any]) -> str:
        return str(self.screen.query_one(selector).render())


def play(snapshot: Snapshot, script: Script, size: tuple[int, int] = (80, 24)) -> BellCounter:
    app = BellCounter(snapshot)

    async def run() -> None:
        async with app.run_test(size=size) as pilot:
            await script(app, pilot)

    asyncio.run(run())
    return app


CHECKING = CrossCheck(1, 3, (4, -2))


def mirror(check: CrossCheck | None = None) -> Snapshot:
    """A session on a display in the mirror."""
    return dataclasses.replace(snapshots.navigating(), has_mirror=True, cross_check=check)


def press(*keys: str) -> Script:
    async def script(_app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press(*keys)

    return script


@pytest.mark.parametrize(
    ("snapshot", "key", "command"),
    [
        (snapshots.navigating(), "space", Blank()),
        (snapshots.starting(), "space", Blank()),
        (snapshots.blanked(), "space", Blank()),
        (snapshots.blanked(), "v", Show()),
        (snapshots.review(), "a", Accept(4)),
        (snapshots.review(), "r", Reject(4)),
        (snapshots.suspended(), "g", Register()),
        (snapshots.registering(), "c", Cancel()),
        (snapshots.navigating(), "right_square_bracket", EnterStage(3)),
        (snapshots.navigating(), "left_square_bracket", EnterStage(1)),
        (snapshots.suspended(), "o", Reconnect()),
        (snapshots.navigating(), "z", ToggleDepth()),
        (snapshots.navigating(), "y", ToggleEye()),
        (snapshots.review(), "q", Quit()),
        (mirror(), "m", CheckMirror()),
        (mirror(CHECKING), "left", NudgeCross(-1, 0)),
        (mirror(CHECKING), "down", NudgeCross(0, 1)),
        (mirror(CHECKING), "shift+up", NudgeCross(0, -10)),
        (mirror(CHECKING), "enter", ConfirmCross()),
    ],
)
def test_a_key_submits_its_command(snapshot: Snapshot, key: str, command: Command) -> None:
    assert play(snapshot, press(key)).session.commands == [command]


@pytest.mark.parametrize("key", ["2", "a", "c", "v", "o", "m", "left", "enter"])
def test_what_makes_no_sense_now_is_submitted_too_the_session_says_why(key: str) -> None:
    """The screen may be older than the session: only the session knows."""
    assert len(play(snapshots.navigating(), press(key)).session.commands) == 1


def test_what_the_session_refuses_rings_once_and_is_told() -> None:
    refused = Event(snapshots.START_NS, "refused", "reject refused: no candidate is under review")

    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        app.session.current = snapshots.navigating(events=(refused,), time_ns=1)
        for _ in range(2):
            app.poll()
            await pilot.pause()
        assert [one.message for one in app._notifications] == [refused.text]
        assert app.n_bells == 1

    play(snapshots.navigating(), script)


def test_a_silent_session_is_asked_for_nothing_but_the_dark_and_the_end() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        for _ in range(20):
            app.poll()
        await pilot.press("g", "space")
        assert app.session.commands == [Blank()]
        assert app.n_bells == 1

    play(snapshots.navigating(), script)


@pytest.mark.parametrize(
    ("key", "page"),
    [
        ("question_mark", HelpPage),
        ("d", DevicesPage),
        ("l", LayersPage),
        ("e", EventsPage),
        ("q", QuitQuestion),
        ("ctrl+q", QuitQuestion),
        ("ctrl+p", None),
    ],
)
def test_space_blanks_on_every_page_and_escape_leaves_it(key: str, page: type[Any] | None) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press(key)
        assert not isinstance(app.screen, MainScreen)
        assert page is None or isinstance(app.screen, page)
        await pilot.press("space")
        assert app.session.commands == [Blank()]
        # Nothing is accepted or thrown away while the picture is covered.
        if page is not None:
            await pilot.press("a", "r", "g", "3")
            assert app.session.commands == [Blank()]
        await pilot.press("escape")
        assert isinstance(app.screen, MainScreen)

    play(snapshots.navigating(), script)


@pytest.mark.parametrize("key", ["question_mark", "d", "l", "e"])
def test_a_page_closes_by_its_own_key_and_by_q_without_quitting(key: str) -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        for closing in (key, "q"):
            await pilot.press(key)
            await pilot.press(closing)
            assert isinstance(app.screen, MainScreen)
        assert app.is_running

    assert play(snapshots.review(), script).session.commands == []


def test_devices_are_reopened_from_their_page() -> None:
    assert play(snapshots.suspended(), press("d", "o")).session.commands == [Reconnect()]


def test_the_palette_offers_actions_of_the_table() -> None:
    async def script(_app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("ctrl+p", *"accept")
        await pilot.pause(0.3)
        await pilot.press("enter", "enter")
        await pilot.pause()

    assert play(snapshots.review(), script).session.commands[0] == Accept(4)


class TestQuitting:
    @pytest.mark.parametrize("make", [snapshots.navigating, snapshots.suspended])
    def test_asks_once_while_navigating(self, make: Callable[[], Snapshot]) -> None:
        app = play(make(), press("q", "y"))
        assert app.session.commands == [Quit()]
        assert app.return_value == 0

    def test_no_and_a_second_q_stay(self) -> None:
        async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
            await pilot.press("q", "q", "q", "n")
            assert isinstance(app.screen, MainScreen)

        assert play(snapshots.navigating(), script).session.commands == []

    def test_a_session_that_is_over_ends_the_application(self) -> None:
        async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
            app.session.current = snapshots.review(is_over=True)
            app.poll()
            await pilot.pause()

        assert play(snapshots.review(), script).return_value == 0

    def test_a_fault_stays_on_the_screen(self) -> None:
        async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
            app.session.current = snapshots.review(is_over=True, state=SessionState.FAULT)
            app.poll()
            await pilot.pause()
            assert app.return_value is None

        play(snapshots.review(), script)


class TestPolling:
    def test_a_missing_picture_is_survived_and_said(self) -> None:
        async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
            await pilot.pause()
            for preview in (snapshots.picture(1.0), None, snapshots.picture(2.0, 96, 40)):
                app.session.current = snapshots.navigating(picture=preview)
                app.poll()
                await pilot.pause()
                view = app.screen.query_one(PictureView)
                lines = [view.render_line(y).text for y in range(view.content_size.height)]
                assert all(len(line) == view.content_size.width for line in lines)
                assert any("waiting" in line for line in lines) is (preview is None)

        play(snapshots.starting(), script)

    def test_an_alarm_rings_once(self) -> None:
        alarm = Event(snapshots.START_NS, "device", "camera lost", EventLevel.ALARM)
        other = dataclasses.replace(alarm, time_ns=snapshots.START_NS + 5)

        async def script(app: BellCounter, _pilot: Pilot[Any]) -> None:
            assert app.n_bells == 0
            for events, n_bells in [
                ((alarm,), 1),
                ((alarm,), 1),
                ((alarm, dataclasses.replace(other, level=EventLevel.WARNING)), 1),
                ((alarm, other), 2),
                ((other,), 2),
                ((), 2),
            ]:
                app.session.current = snapshots.navigating(events=events)
                app.poll()
                assert app.n_bells == n_bells

        play(snapshots.navigating(), script)

    def test_an_alarm_that_is_there_at_the_start_rings_too(self) -> None:
        async def script(app: BellCounter, _pilot: Pilot[Any]) -> None:
            app.poll()

        assert play(snapshots.suspended(), script).n_bells == 1

    def test_numbers_wait_for_their_poll_but_the_status_does_not(self) -> None:
        async def script(app: BellCounter, _pilot: Pilot[Any]) -> None:
            assert "18 ms" in app.text_of(PosePanel)
            app.session.current = snapshots.navigating(pose_age_ms=31.0)
            for _ in range(POLLS_PER_TEXT - 1):
                app.poll()
                assert "18 ms" in app.text_of(PosePanel)
            app.poll()
            assert "31 ms" in app.text_of(PosePanel)
            app.session.current = snapshots.suspended()
            app.poll()
            assert "NAVIGABLE  NO" in app.text_of(PosePanel)

        play(snapshots.navigating(), script)

    def test_a_session_that_falls_silent_is_not_believed(self) -> None:
        async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
            for _ in range(SILENT_AFTER_POLLS - 1):
                app.poll()
            assert "NAVIGABLE  yes" in app.text_of(PosePanel)
            app.poll()
            assert "NAVIGABLE  NO" in app.text_of(PosePanel)
            await pilot.press("g", "3", "space")
            assert app.session.commands == [Blank()]
            now_ns = app.session.current.time_ns + 1
            app.session.current = snapshots.navigating(time_ns=now_ns)
            app.poll()
            assert "NAVIGABLE  yes" in app.text_of(PosePanel)

        play(snapshots.navigating(), script)

    def test_a_start_may_take_longer_but_not_for_ever(self) -> None:
        async def script(app: BellCounter, _pilot: Pilot[Any]) -> None:
            for _ in range(100):
                app.poll()
            assert "no registration" in app.text_of(PosePanel)
            for _ in range(60 * POLLS_PER_S):
                app.poll()
            assert "gives no" in app.text_of(PosePanel)

        play(snapshots.starting(), script)

    def test_the_picture_goes_on_behind_the_question(self) -> None:
        async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
            await pilot.press("q")
            app.session.current = snapshots.suspended()
            app.poll()
            main = app.screen_stack[0]
            assert main.query_one(PictureView).border_title == "left view · NO GUIDES"

        play(snapshots.navigating(), script)

    def test_events_appear_on_their_open_page(self) -> None:
        async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
            await pilot.press("e")
            assert "stage 2 drilling" in str(app.screen.query_one("#all-events", Static).content)
            app.session.current = snapshots.suspended()
            app.poll()
            assert "guides hidden" in str(app.screen.query_one("#all-events", Static).content)

        play(snapshots.navigating(), script)

    def test_a_session_that_breaks_ends_the_application_without_a_traceback(
        self, capfd: pytest.CaptureFixture[str]
    ) -> None:
        app = BellCounter(snapshots.navigating())

        async def run() -> None:
            async with app.run_test() as pilot:
                app.session.current = None  # type: ignore[assignment]
                app.call_later(app.poll)
                await pilot.pause()

        with pytest.raises(AttributeError):
            asyncio.run(run())
        assert isinstance(app.failure, AttributeError)
        assert "Traceback" not in "".join(capfd.readouterr())


def test_resizing_is_survived() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        screen = app.screen
        for size, is_small in [
            ((80, 24), False),
            ((160, 48), False),
            ((60, 20), True),
            ((10, 3), True),
            ((100, 30), False),
            ((300, 80), False),
        ]:
            await pilot.resize_terminal(*size)
            await pilot.pause()
            app.poll_until_text()
            await pilot.pause()
            assert screen.query_one(SmallNotice).display is is_small
            assert screen.query_one("#body").display is not is_small
        assert "NAVIGABLE" in app.text_of(PosePanel)

    play(snapshots.suspended(), script)


def test_a_small_terminal_still_says_why() -> None:
    async def script(app: BellCounter, _pilot: Pilot[Any]) -> None:
        text = app.text_of(SmallNotice)
        assert "NAVIGABLE  NO" in text
        assert "the bone is lost" in text
        assert "research, not for clinical use" in text

    play(snapshots.suspended(stage=STAGES[2]), script, size=(60, 20))


def test_arrows_go_through_candidates_where_several_wait() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("right", "left")

    app = play(snapshots.compared(), script)
    assert app.session.commands == [ChooseCandidate(1), ChooseCandidate(-1)]
    app = play(snapshots.navigating(cross_check=CHECKING), script)
    assert app.session.commands == [NudgeCross(1, 0), NudgeCross(-1, 0)]


@pytest.mark.parametrize(
    ("place", "numbers"), [(0, [1, 2, 3]), (1, [1, 2, 3]), (3, [3, 4, 5]), (4, [3, 4, 5])]
)
def test_of_many_candidates_the_one_under_review_is_among_those_side_by_side(
    place: int, numbers: list[int]
) -> None:
    first, *_ = snapshots.compared().candidates
    waiting = tuple(dataclasses.replace(first, number=k + 1, is_shown=k == place) for k in range(5))

    async def script(app: BellCounter, _pilot: Pilot[Any]) -> None:
        views = list(app.screen.query(CandidateView))
        titles = [str(one.border_title).lstrip(f"{UNICODE.ok} ") for one in views]
        assert [int(title[0]) for title in titles] == numbers
        assert [one.has_class("-shown") for one in views] == [k == place + 1 for k in numbers]

    play(snapshots.compared(candidates=waiting), script, size=(200, 60))


def test_without_an_encoder_the_screen_knows_that_no_outline_is_seen() -> None:
    session = snapshots.ScriptedSession(snapshots.review())
    assert NavigationApp(session, polls_per_s=0)._view.has_colours
    assert not NavigationApp(session, polls_per_s=0, graphics=Graphics())._view.has_colours
    blocks = Graphics(BlockEncoder(is_true_colour=False), CELL_PX)
    assert NavigationApp(session, polls_per_s=0, graphics=blocks)._view.has_colours
