"""The application: polls the session, passes views to the screens, submits commands."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from textual import events
from textual.binding import BindingType
from textual.screen import Screen

from navapp.control.commands import (
    CheckPicks,
    Command,
    ConfirmCondition,
    ConfirmStep,
    DropPoint,
    EnterStage,
    ForgetPoints,
    OverrideGate,
    Quit,
    Register,
    SetProjector,
    ToggleLayer,
    TouchPoint,
    WithdrawCondition,
    WithdrawStep,
)
from navapp.control.states import (
    Event,
    EventLevel,
    SessionState,
    Snapshot,
)
from navapp.geometry.box import Box
from navapp.preop import PlanView
from navapp.ui.actions import (
    ACTION_OF_KEY_EVERYWHERE,
    ACTION_OF_NAME,
    bindings,
    is_possible,
)
from navapp.ui.background import Background
from navapp.ui.calibration_page import CalibrationPage
from navapp.ui.gates_page import REASONS, GatesPage, condition_of_key
from navapp.ui.help_page import HelpPage
from navapp.ui.layers_page import LayersPage
from navapp.ui.main_screen import MainScreen
from navapp.ui.pages import DevicesPage, EventsPage, PowerQuestion, QuitQuestion
from navapp.ui.palette import ActionProvider
from navapp.ui.picks_page import PicksChecked, PicksPage, Place
from navapp.ui.pictures.graphics import Graphics
from navapp.ui.pictures.picture_view import PictureView
from navapp.ui.plan_page import PlanPage
from navapp.ui.quiet_app import QuietApp
from navapp.ui.screens import ViewScreen
from navapp.ui.session import Session
from navapp.ui.settings_page import SettingsPage
from navapp.ui.slice_walk import SliceWalk
from navapp.ui.start_page import StartChosen, StartPage
from navapp.ui.steps_page import StepsPage, step_of_key
from navapp.ui.symbols import UNICODE, Symbols
from navapp.ui.theme import NAVAPP_THEME
from navapp.ui.tools_page import ToolsPage, landmark_of_key
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


class NavigationApp(QuietApp):
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
        super().__init__()
        if graphics is not None:
            self.use_graphics(graphics)
        self.register_theme(NAVAPP_THEME)
        self.theme = NAVAPP_THEME.name
        self.title = title
        self._session = session
        self._symbols = symbols
        self._polls_per_s = polls_per_s
        self._hints = tuple(hints)
        self._background = background
        self._walk = None if plan is None else SliceWalk(plan)
        self._n_polls = 0
        self._n_unchanged = 0
        snapshot = session.snapshot()
        start_ns = min([snapshot.time_ns, *(event.time_ns for event in snapshot.events)])
        self._view = View(
            snapshot,
            symbols,
            start_ns,
            title=title,
            has_colours=graphics is None or graphics.has_colours,
        )
        self._known_events: frozenset[Event] = frozenset()
        self._start_box: Box | None = None  # as it was drawn last
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

    def on_start_chosen(self, message: StartChosen) -> None:
        """Search for the bone where an operator has drawn or picked it."""
        if message.start.box is not None:
            self._start_box = Box(*message.start.box)
        if self._view.is_silent:
            self._say_silent("register")
        else:
            self._session.submit(Register(message.start, message.bone))

    def on_picks_checked(self, message: PicksChecked) -> None:
        """Compare picked landmarks with the accepted registration."""
        if self._view.is_silent:
            self._say_silent("the check")
        else:
            self._session.submit(CheckPicks(message.picks))

    def action_confirm_condition(self, key: str) -> None:
        """Say that a condition is met: from the gates' page."""
        self._say_of(condition_of_key(self._view.snapshot, key), ConfirmCondition)

    def action_withdraw_condition(self, key: str) -> None:
        """Say that it is not met after all."""
        self._say_of(condition_of_key(self._view.snapshot, key), WithdrawCondition)

    def action_pass_gate(self) -> None:
        """Enter the stage whose gate the page shows."""
        self._session.submit(EnterStage(self._view.snapshot.gate_stage))

    def action_override_gate(self, number: str) -> None:
        """Enter it whatever is open, with one of the page's reasons."""
        reason = REASONS[int(number) - 1]
        self._session.submit(OverrideGate(self._view.snapshot.gate_stage, reason))

    def action_toggle_layer(self, name: str) -> None:
        """Draw a layer, or no longer: from the page that lists them."""
        self._session.submit(ToggleLayer(name))

    def action_confirm_step(self, key: str) -> None:
        """Say that a step has been made: from the steps' page."""
        self._say_of(step_of_key(self._view.snapshot, key), ConfirmStep)

    def action_withdraw_step(self, key: str) -> None:
        """Say that a step has not been made after all."""
        self._say_of(step_of_key(self._view.snapshot, key), WithdrawStep)

    def action_touch_point(self, landmark: str) -> None:
        """Take a point of the check on the patient: from the tools' page."""
        if self._view.is_silent:
            self._say_silent("a point")
        else:
            self._session.submit(TouchPoint(landmark))

    def action_touch_landmark(self, key: str) -> None:
        """Take a point on the landmark that a letter means."""
        self._say_of(landmark_of_key(self._view.snapshot, key), TouchPoint)

    def action_drop_point(self) -> None:
        """Forget the point that was taken last."""
        self._session.submit(DropPoint())

    def action_forget_points(self) -> None:
        """Begin the check anew."""
        self._session.submit(ForgetPoints())

    def action_set_projector(self, name: str) -> None:
        """Tell the projector a setting: from the devices' page; asked before it goes off."""

        def finish(is_sure: bool | None) -> None:
            if is_sure:
                self._say_of(name, SetProjector)

        if name == "off":
            self.push_screen(PowerQuestion(self._view), finish)
        else:
            finish(is_sure=True)

    def _say_of(self, name: str | None, word: Callable[[str], Command]) -> None:
        """A person's word for what a letter of a page means; nothing where it means nothing."""
        if name is None:
            return
        if self._view.is_silent:
            self._say_silent(name)
        else:
            self._session.submit(word(name))

    def _say_silent(self, what: str) -> None:
        """No key is dropped in silence."""
        self.bell()
        self.notify(f"{what} needs a session that answers", severity="warning")

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
