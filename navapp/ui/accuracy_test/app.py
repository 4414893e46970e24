"""The application of an accuracy test."""

from dataclasses import dataclass
from pathlib import Path

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.content import Content

from navapp.control.accuracy_test.states import AccuracyCommand, AccuracySnapshot, Back, Leave, Take
from navapp.ui.gauges import cut, draw_fraction_bar
from navapp.ui.guided_app import (
    POLLS_PER_S,
    GuidedApp,
    GuidedScreen,
    GuidedSession,
    run_guided_app,
)
from navapp.ui.guided_panels import TOO_SMALL, format_events, format_key, format_title
from navapp.ui.pictures.picture import Picture
from navapp.ui.symbols import UNICODE, Symbols
from navapp.ui.text_view import Lines
from navapp.ui.view import Level

_COMMANDS: dict[str, AccuracyCommand] = {"enter": Take(), "x": Back(), "q": Leave()}
_KEYS = (("ENTER", "take"), ("x", "the last one again"), ("q", "leave"))
_BAR_WIDTH = 22
AccuracySession = GuidedSession[AccuracySnapshot, AccuracyCommand]


@dataclass(frozen=True, slots=True, eq=False)
class AccuracyView:
    """What is shown: a snapshot and the characters for it."""

    snapshot: AccuracySnapshot
    symbols: Symbols


class AccuracyTitle(Lines[AccuracyView]):
    """Camera at the left, tasks at the right."""

    def build(self, view: AccuracyView, width: int, height: int) -> list[Content]:
        """One line."""
        snapshot = view.snapshot
        right = Content.styled(f"{snapshot.n_kept} of {snapshot.n_tasks} ", "bold $foreground")
        camera = snapshot.camera
        name, is_sim = camera.removeprefix("sim:"), camera.startswith("sim:")
        return [format_title("accuracy-test", name, right, width, is_sim=is_sim)]


class TaskLines(Lines[AccuracyView]):
    """What to do, how far it is, and how the tool is seen."""

    def build(self, view: AccuracyView, width: int, height: int) -> list[Content]:
        """Three lines."""
        snapshot, symbols = view.snapshot, view.symbols
        text = "all tasks are done" if snapshot.task is None else snapshot.task.instruction
        told = cut(text, max(width - 10, 0), symbols)
        word = "taking" if snapshot.is_taking else "press ENTER when it is so"
        seen, level = snapshot.missing, Level.ATTENTION
        if not seen and snapshot.bound_mm is not None:
            seen, level = f"tip {symbols.at_most}{snapshot.bound_mm:.2f} mm", Level.OK
        return [
            Content.assemble((" to do   ", "$text-muted"), (told, Level.ATTENTION.value)),
            Content.assemble(
                (" taken   ", "$text-muted"),
                (draw_fraction_bar(snapshot.share, _BAR_WIDTH, symbols), "$primary"),
                f" {word}",
            ),
            Content.assemble(
                (" pointer ", "$text-muted"), (f"{level.mark(symbols)} {seen}", level.value)
            ).truncate(width),
        ]


class AccuracyEvents(Lines[AccuracyView]):
    """What happened, newest first."""

    def build(self, view: AccuracyView, width: int, height: int) -> list[Content]:
        """As many lines as there is room for."""
        return format_events(view.snapshot.events, width, height, view.symbols)


class AccuracyFooter(Lines[AccuracyView]):
    """The keys."""

    def build(self, view: AccuracyView, width: int, height: int) -> list[Content]:
        """One line."""
        parts = [part for key, label in _KEYS for part in format_key(key, label)]
        return [Content.assemble(*parts).truncate(width)]


class SmallAccuracy(Lines[AccuracyView]):
    """Stands in for everything on a terminal that is too small."""

    def build(self, view: AccuracyView, width: int, height: int) -> list[Content]:
        """Most important line first."""
        task = view.snapshot.task
        return [
            Content("all tasks are done" if task is None else task.instruction),
            TOO_SMALL,
        ]


class AccuracyScreen(GuidedScreen[AccuracySnapshot]):
    """Both pictures, what to do, what is done."""

    def compose(self) -> ComposeResult:
        """From top to bottom."""
        yield SmallAccuracy("small")
        with Vertical(id="body"):
            yield AccuracyTitle("title")
            with Horizontal(id="pictures"):
                yield Picture("left")
                yield Picture("right")
            yield TaskLines("task")
            yield AccuracyEvents("events")
            yield AccuracyFooter("footer")

    def on_mount(self) -> None:
        """Name the pictures."""
        self.name_pictures()

    def show(self, snapshot: AccuracySnapshot, symbols: Symbols) -> None:
        """Pass a snapshot on."""
        self.pass_on(snapshot.pictures, symbols, AccuracyView(snapshot, symbols))


class AccuracyApp(GuidedApp[AccuracySnapshot, AccuracyCommand]):
    """The operator's screen for one accuracy test."""

    CSS_PATH = Path(__file__).with_name("accuracy_test.tcss")

    def __init__(
        self,
        session: AccuracySession,
        *,
        symbols: Symbols = UNICODE,
        polls_per_s: int = POLLS_PER_S,
    ) -> None:
        super().__init__(session, AccuracyScreen(), symbols=symbols, polls_per_s=polls_per_s)

    def find_command(self, key: str, snapshot: AccuracySnapshot) -> AccuracyCommand | None:
        """What a key means."""
        return _COMMANDS.get(key)


def run_accuracy_app(session: AccuracySession, log_path: Path) -> int:
    """Run the screen until it ends; see `run_guided_app`."""
    return run_guided_app(lambda symbols: AccuracyApp(session, symbols=symbols), log_path)
