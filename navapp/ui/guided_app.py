"""The application of a guided calibration: polls it, shows it, submits what keys say."""

import asyncio
import os
import sys
import traceback
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from textual import events
from textual.screen import Screen

from navapp.ui.pictures.picture import Picture
from navapp.ui.quiet_app import QuietApp, drive, say
from navapp.ui.symbols import UNICODE, Symbols, choose_symbols
from navapp.ui.terminal import own_terminal
from navapp.ui.text_view import Lines
from navapp.ui.theme import NAVAPP_THEME

Pictures = tuple[NDArray[np.uint8], NDArray[np.uint8]] | None
POLLS_PER_S = 8
_INTERRUPTED = 130  # exit code, as of a program that ctrl+c ends
_CHARACTERS = {"+": "plus", "-": "minus"}


class Counting(Protocol):
    """A snapshot that counts what was kept."""

    @property
    def n_kept(self) -> int:
        """So far."""
        ...


SnapshotT = TypeVar("SnapshotT", bound=Counting)
SnapshotT_co = TypeVar("SnapshotT_co", covariant=True)
CommandT = TypeVar("CommandT")
CommandT_contra = TypeVar("CommandT_contra", contravariant=True)


class GuidedSession(Protocol[SnapshotT_co, CommandT_contra]):
    """A running calibration as the screen sees it. No call blocks."""

    @property
    def is_over(self) -> bool:
        """Nothing more will come."""
        ...

    def snapshot(self) -> SnapshotT_co:
        """The newest snapshot."""
        ...

    def submit(self, command: CommandT_contra) -> None:
        """Hand over a command."""
        ...


class GuidedScreen(Screen[None], Generic[SnapshotT]):
    """The only screen of a guided calibration."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (80, "-enough")]  # noqa: RUF012 (as the base class)
    VERTICAL_BREAKPOINTS = [(0, "-low"), (24, "-even"), (40, "-tall")]  # noqa: RUF012

    @property
    def is_small(self) -> bool:
        """The terminal is too small for more than the essential."""
        return self.has_class("-narrow") or self.has_class("-low")

    def show(self, snapshot: SnapshotT, symbols: Symbols) -> None:
        """Show a snapshot with these characters."""
        raise NotImplementedError

    def name_pictures(self) -> None:
        """Of both cameras."""
        for side in ("left", "right"):
            self.query_one(f"#{side}").border_title = side

    def pass_on(self, pictures: Pictures, symbols: Symbols, view: object) -> None:
        """Both cameras' pictures to their widgets, and a view to all lines."""
        for side, picture in zip(("left", "right"), pictures or (None, None), strict=True):
            self.query_one(f"#{side}", Picture).show_picture(picture, symbols.ramp)
        for lines in self.query(Lines):
            lines.show(view)


class GuidedApp(QuietApp, Generic[SnapshotT, CommandT]):
    """The operator's screen for one calibration.

    Args:
        session: that runs elsewhere.
        screen: that shows it.
        symbols: that the terminal can draw.
        polls_per_s: how often the newest snapshot is taken; 0 means only when `poll` is called.
    """

    ENABLE_COMMAND_PALETTE = False
    ALLOW_SELECT = False

    def __init__(
        self,
        session: GuidedSession[SnapshotT, CommandT],
        screen: GuidedScreen[SnapshotT],
        *,
        symbols: Symbols = UNICODE,
        polls_per_s: int = POLLS_PER_S,
    ) -> None:
        super().__init__()
        self.register_theme(NAVAPP_THEME)
        self.theme = NAVAPP_THEME.name
        self._session, self._symbols, self._polls_per_s = session, symbols, polls_per_s
        self._guided_screen = screen
        self._n_kept = 0

    def find_command(self, key: str, snapshot: SnapshotT) -> CommandT | None:
        """What a key, as Textual names it, submits now; None for nothing."""
        raise NotImplementedError

    def get_default_screen(self) -> Screen[None]:
        """The only one."""
        return self._guided_screen

    def on_mount(self) -> None:
        """Begin to look."""
        self._guided_screen.set_class(self._symbols.is_ascii, "-ascii")
        self.call_after_refresh(self.poll)
        if self._polls_per_s > 0:
            self.set_interval(1 / self._polls_per_s, self.poll)

    def poll(self) -> None:
        """Take the newest snapshot and show it; what is kept rings once."""
        snapshot = self._session.snapshot()
        self._guided_screen.show(snapshot, self._symbols)
        if snapshot.n_kept > self._n_kept:
            self.bell()
        self._n_kept = snapshot.n_kept
        if self._session.is_over:
            self.exit(0)

    def on_key(self, event: events.Key) -> None:
        """Submit what the key says, when it makes sense now."""
        key = _CHARACTERS.get(event.character or "", event.key)
        command = self.find_command(key, self._session.snapshot())
        if command is not None:
            event.stop()
            self._session.submit(command)

    async def action_quit(self) -> None:
        """Textual's own way to quit: an interruption."""
        self.exit(_INTERRUPTED)

    def action_help_quit(self) -> None:
        """What Textual does at ctrl+c."""
        self.exit(_INTERRUPTED)


class MakeApp(Protocol):
    """Makes the application for the characters that the terminal can draw."""

    def __call__(self, symbols: Symbols) -> QuietApp:
        """Not running yet."""
        ...


def run_guided_app(make: MakeApp, log_path: Path) -> int:
    """Run the screen until it ends.

    Args:
        make: the application of a session that runs already.
        log_path: takes what libraries print meanwhile, and the traceback of a failure.

    Returns:
        Exit code. After a failure of the screen one sentence is on the standard error.
    """
    with own_terminal(log_path):
        app = make(choose_symbols(getattr(sys.__stdout__, "encoding", None), os.environ))
        code = asyncio.run(drive(app))
        if app.failure is not None:
            traceback.print_exception(app.failure, file=sys.stderr)
    return code if app.failure is None else say(app.failure, log_path)
