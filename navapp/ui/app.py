"""The application: polls the session, passes views to the screens, submits commands."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from textual import events
from textual.binding import BindingType
from textual.screen import Screen

from navapp.control.commands import (
    Quit,
)
from navapp.control.states import (
    Event,
    EventLevel,
    SessionState,
    Snapshot,
)
from navapp.preop import PlanView
from navapp.ui.actions import (
    ACTION_OF_KEY_EVERYWHERE,
    ACTION_OF_NAME,
    bindings,
    is_possible,
)
from navapp.ui.background import Background
from navapp.ui.calibration_page import CalibrationPage
from navapp.ui.gates_page import GatesPage
from navapp.ui.help_page import HelpPage
from navapp.ui.layers_page import LayersPage
from navapp.ui.main_screen import MainScreen
from navapp.ui.page_commands import PageCommands
from navapp.ui.pages import DevicesPage, EventsPage, QuitQuestion
from navapp.ui.palette import ActionProvider
from navapp.ui.picks_page import PicksPage, Place
from navapp.ui.pictures.graphics import Graphics
from navapp.ui.pictures.picture_view import PictureView
from navapp.ui.plan_page import PlanPage
from navapp.ui.screens import ViewScreen
from navapp.ui.session import Session
from navapp.ui.settings_page import SettingsPage
from navapp.ui.slice_walk import SliceWalk
from navapp.ui.start_page import StartPage
from navapp.ui.steps_page import StepsPage
from navapp.ui.symbols import UNICODE, Symbols
from navapp.ui.theme import NAVAPP_THEME
from navapp.ui.tools_page import ToolsPage
from navapp.ui.view import View

POLLS_PER_S = 10
# Numbers that change faster than four times a second cannot be read.
POLLS_PER_TEXT = 3
# Two seconds without a new snapshot: the screen no longer believes the old one.
SILENT_AFTER_POLLS = 2 * POLLS_PER_S
# Kernels that compile at the first start may keep a session busy.
_SILENT_AFTER_POLLS_AT_START = 60 * POLLS_PER_S
_HINT_S = 8.0
_START_STATES = (SessionState.OFFLINE, SessionState.STARTING)
_ASKING_STATES = (SessionState.NAVIGATING, SessionState.SUSPENDED)
_PAGES = {
    "help": HelpPage,
    "layers": LayersPage,
    "steps": StepsPage,
    "gates": GatesPage,
    "tools": ToolsPage,
    "devices": DevicesPage,
    "events": EventsPage,
}

_BACKGROUND_PAGES = {"calibration": CalibrationPage, "settings": SettingsPage}


class NavigationApp(PageCommands):
    """The operator's screen for one session.

    Args:
        session: that runs elsewhere.
        title: first word of the title line.
        symbols: that the terminal can draw.
        polls_per_s: how often the newest snapshot is taken; 0 means only when `poll` is called.
        graphics: that the terminal draws; None: half blocks.
        hints: told when it starts.
        background: settings and calibrations; None: their pages say that they are not known.
        plan: to look at; None: it cannot be looked at.
    """

    CSS_PATH = Path(__file__).with_name("navapp.tcss")
    COMMANDS = {ActionProvider}  # noqa: RUF012 (as the base class has it)
    BINDINGS: ClassVar[list[BindingType]] = bindings()
    ENABLE_COMMAND_PALETTE = True
    uses_mouse = True
    ALLOW_SELECT = False

    def __init__(
        self,
        session: Session,
        title: str = "navapp",
        *,
        symbols: Symbols = UNICODE,
        polls_per_s: int = POLLS_PER_S,
        graphics: Graphics | None = None,
        hints: Sequence[str] = (),
        background: Background | None = None,
        plan: PlanView | None = None,
    ) -> None:
        snapshot = session.snapshot()
        start_ns = min([snapshot.time_ns, *(event.time_ns for event in snapshot.events)])
        has_colours = graphics is None or graphics.has_colours
        view = View(snapshot, symbols, start_ns, title=title, has_colours=has_colours)
        super().__init__(session, view)
        if graphics is not None:
            self.use_graphics(graphics)
        self.register_theme(NAVAPP_THEME)
        self.theme = NAVAPP_THEME.name
        self.title = title
        self._symbols = symbols
        self._polls_per_s = polls_per_s
        self._hints = tuple(hints)
        self._background = background
        self._walk = None if plan is None else SliceWalk(plan)
        self._n_polls = 0
        self._n_unchanged = 0
        self._known_events: frozenset[Event] = frozenset()
        self._picks: dict[str, Place] = {}  # as they were picked last

    def get_default_screen(self) -> Screen[None]:
        """The main screen."""
        return MainScreen(self._view)

    def on_mount(self) -> None:
        """Begin to look."""
        self._ring(self._view.snapshot)
        for hint in self._hints:
            self.notify(hint, timeout=_HINT_S)
        if self._polls_per_s > 0:
            self.set_interval(1 / self._polls_per_s, self.poll)

    def poll(self) -> None:
        """Take the newest snapshot and show it on every screen."""
        old, snapshot = self._view, self._session.snapshot()
        is_same = snapshot.time_ns == old.snapshot.time_ns
        self._n_unchanged = self._n_unchanged + 1 if is_same else 0
        is_start = snapshot.state in _START_STATES
        limit = _SILENT_AFTER_POLLS_AT_START if is_start else SILENT_AFTER_POLLS
        is_silent = self._n_unchanged >= limit
        self._view = replace(old, snapshot=snapshot, is_silent=is_silent)
        self._n_polls += 1
        is_text_due = self._n_polls % POLLS_PER_TEXT == 0 or _status(self._view) != _status(old)
        for screen in self.screen_stack:
            if isinstance(screen, ViewScreen):
                screen.show(self._view, is_text_due=is_text_due)
        self._ring(snapshot)
        if snapshot.refused_stage not in (None, old.snapshot.refused_stage):
            self._open_gates()
        if snapshot.is_over and snapshot.state is not SessionState.FAULT:
            self.exit(0)

    def _ring(self, snapshot: Snapshot) -> None:
        """Ring once for what was not there before: alarms, and commands that were refused."""
        events = frozenset(snapshot.events)
        new, self._known_events = events - self._known_events, events
        refused = [event.text for event in new if event.kind == "refused"]
        if refused or any(event.level is EventLevel.ALARM for event in new):
            self.bell()
        for text in refused:
            self.notify(text, severity="warning")

    def action_act(self, name: str) -> None:
        """Do an action of the table; the session answers what it refuses with an event."""
        action, view = ACTION_OF_NAME[name], self._view
        if name == "quit":
            self._ask_to_quit(view)
        elif name == "start":
            self.push_screen(StartPage(view, self._start_box))
        elif name == "picks":
            self.push_screen(PicksPage(view, self._picks))
        elif name == "near":
            self._toggle_near()
        elif name == "plan":
            self._open_plan()
        elif name in _BACKGROUND_PAGES:
            self._open_background(name)
        elif name in _PAGES:
            self.push_screen(_PAGES[name](view))
        elif view.is_silent and not is_possible(action, view.snapshot, is_silent=True):
            self._say_silent(action.label)
        elif action.command is not None:
            self._session.submit(action.command(view.snapshot))

    def _open_background(self, name: str) -> None:
        """What the session stands on."""
        if self._background is None:
            self.notify(f"the {name} of this session is not known here", severity="warning")
        else:
            self.push_screen(_BACKGROUND_PAGES[name](self._view, self._background))

    def _open_plan(self) -> None:
        """Its slices, where they were left."""
        if self._walk is None:
            self.notify("the plan of this session is not at hand", severity="warning")
        else:
            self.push_screen(PlanPage(self._view, self._walk))

    def _toggle_near(self) -> None:
        """The region around the bone, or the whole picture."""
        picture = self.screen_stack[0].query_one(PictureView)
        self._view = replace(self._view, is_near=not picture.is_near(self._view))
        picture.show(self._view)
        if self._view.is_near and self._view.snapshot.bone_box is None:
            self.notify("the region around the bone is shown when the bone is found")

    def _open_gates(self) -> None:
        """A gate was told as not met: its page, unless it is open."""
        if not isinstance(self.screen, GatesPage):
            self.push_screen(GatesPage(self._view))

    def _ask_to_quit(self, view: View) -> None:
        def finish(is_sure: bool | None) -> None:
            if is_sure:
                self._session.submit(Quit())
                self.exit(0)

        if any(isinstance(screen, QuitQuestion) for screen in self.screen_stack):
            return
        if view.snapshot.state in _ASKING_STATES:
            self.push_screen(QuitQuestion(view), finish)
        else:
            finish(is_sure=True)

    async def on_event(self, event: events.Event) -> None:
        """Keys for everywhere come before anything that has the focus, a text field included."""
        if isinstance(event, events.Key) and event.key in ACTION_OF_KEY_EVERYWHERE:
            self.action_act(ACTION_OF_KEY_EVERYWHERE[event.key].name)
            return
        await super().on_event(event)

    async def action_quit(self) -> None:
        """Textual's own way to quit asks too."""
        self.action_act("quit")

    def action_help_quit(self) -> None:
        """What Textual does at ctrl+c."""
        self.action_act("quit")


def _status(view: View) -> tuple[object, ...]:
    """What must be seen at once when it changes."""
    snapshot = view.snapshot
    return (
        view.is_silent,
        snapshot.state,
        snapshot.reasons,
        snapshot.is_blanked,
        snapshot.is_candidate,
        snapshot.stage,
    )
