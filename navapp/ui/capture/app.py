"""The application of a guided capture: polls it, shows it, submits what keys say."""

import asyncio
import os
import sys
import traceback
from pathlib import Path
from typing import Protocol

from textual import events
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.screen import Screen

from navapp.control.capture.states import CaptureCommand, CaptureSnapshot
from navapp.ui.capture.keys import KEYS, command_of, is_possible
from navapp.ui.capture.panels import (
    CaptureEvents,
    CaptureFooter,
    CaptureTitle,
    CaptureView,
    CheckLine,
    CoverageMap,
    GaugeLine,
    InstructionLines,
    SmallCapture,
)
from navapp.ui.picture_view import HalfBlocks
from navapp.ui.quiet_app import QuietApp, drive, say
from navapp.ui.symbols import UNICODE, Symbols, choose_symbols
from navapp.ui.terminal import own_terminal
from navapp.ui.text_view import Lines
from navapp.ui.theme import NAVAPP_THEME

POLLS_PER_S = 8
_KEYS = {key.key: key for key in KEYS}
_CHARACTERS = {"+": "plus", "-": "minus"}


class CaptureSession(Protocol):
    """A running capture as the screen sees it. No call blocks."""

    @property
    def is_over(self) -> bool:
        """Nothing more will come."""
        ...

    def snapshot(self) -> CaptureSnapshot:
        """The newest snapshot."""
        ...

    def submit(self, command: CaptureCommand) -> None:
        """Hand over a command."""
        ...


class CaptureScreen(Screen[None]):
    """Both pictures, what is wanted, what is kept."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (80, "-enough")]  # noqa: RUF012 (as the base class)
    VERTICAL_BREAKPOINTS = [(0, "-low"), (24, "-even"), (40, "-tall")]  # noqa: RUF012

    def compose(self) -> ComposeResult:
        """From top to bottom."""
        yield SmallCapture("small")
        with Vertical(id="body"):
            yield CaptureTitle("title")
            with Horizontal(id="pictures"):
                yield HalfBlocks("left")
                yield HalfBlocks("right")
            yield InstructionLines("wish")
            yield CheckLine("checks")
            yield GaugeLine("gauge")
            with Horizontal(id="kept"):
                yield CoverageMap("coverage")
                yield CaptureEvents("events")
            yield CaptureFooter("footer")

    def on_mount(self) -> None:
        """Name the pictures."""
        for side in ("left", "right"):
            self.query_one(f"#{side}").border_title = side

    def show(self, view: CaptureView) -> None:
        """Pass a view on."""
        pictures = view.snapshot.pictures or (None, None)
        for side, picture in zip(("left", "right"), pictures, strict=True):
            self.query_one(f"#{side}", HalfBlocks).show_picture(picture, view.symbols.ramp)
        for lines in self.query(Lines):
            lines.show(view)


class CaptureApp(QuietApp):
    """The operator's screen for one capture.

    Args:
        session: that runs elsewhere.
        symbols: that the terminal can draw.
        polls_per_s: how often the newest snapshot is taken; 0 means only when `poll` is called.
    """

    CSS_PATH = Path(__file__).with_name("capture.tcss")
    ENABLE_COMMAND_PALETTE = False
    ALLOW_SELECT = False

    def __init__(
        self,
        session: CaptureSession,
        *,
        symbols: Symbols = UNICODE,
        polls_per_s: int = POLLS_PER_S,
    ) -> None:
        super().__init__()
        self.register_theme(NAVAPP_THEME)
        self.theme = NAVAPP_THEME.name
        self._session, self._symbols, self._polls_per_s = session, symbols, polls_per_s
        self._capture_screen = CaptureScreen()
        self._n_kept = 0

    def get_default_screen(self) -> Screen[None]:
        """The only one."""
        return self._capture_screen

    def on_mount(self) -> None:
        """Begin to look."""
        self._capture_screen.set_class(self._symbols.is_ascii, "-ascii")
        self.call_after_refresh(self.poll)
        if self._polls_per_s > 0:
            self.set_interval(1 / self._polls_per_s, self.poll)

    def poll(self) -> None:
        """Take the newest snapshot and show it; a kept pair rings once."""
        snapshot = self._session.snapshot()
        self._capture_screen.show(CaptureView(snapshot, self._symbols))
        if snapshot.n_kept > self._n_kept:
            self.bell()
        self._n_kept = snapshot.n_kept
        if self._session.is_over:
            self.exit(0)

    def on_key(self, event: events.Key) -> None:
        """Submit what the key says, when it makes sense now."""
        key = _KEYS.get(_CHARACTERS.get(event.character or "", event.key))
        snapshot = self._session.snapshot()
        if key is not None and is_possible(key, snapshot):
            event.stop()
            self._session.submit(command_of(key, snapshot))

    async def action_quit(self) -> None:
        """Textual's own way to quit."""
        self.exit(0)

    def action_help_quit(self) -> None:
        """What Textual does at ctrl+c."""
        self.exit(0)


def run_capture_app(session: CaptureSession, log_path: Path) -> int:
    """Run the screen until it ends.

    Args:
        session: that runs already.
        log_path: takes what libraries print meanwhile, and the traceback of a failure.

    Returns:
        Exit code. After a failure of the screen one sentence is on the standard error.
    """
    with own_terminal(log_path):
        symbols = choose_symbols(getattr(sys.__stdout__, "encoding", None), os.environ)
        app = CaptureApp(session, symbols=symbols)
        code = asyncio.run(drive(app))
        if app.failure is not None:
            traceback.print_exception(app.failure, file=sys.stderr)
    return code if app.failure is None else say(app.failure, log_path)
