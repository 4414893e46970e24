"""The application of a tool's calibration."""

from pathlib import Path

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical

from navapp.control.tool_calibration.states import (
    Again,
    Finish,
    Leave,
    ToolCommand,
    ToolSnapshot,
)
from navapp.ui.guided_app import (
    POLLS_PER_S,
    GuidedApp,
    GuidedScreen,
    GuidedSession,
    run_guided_app,
)
from navapp.ui.pictures.picture import Picture
from navapp.ui.symbols import UNICODE, Symbols
from navapp.ui.tool_calibration.panels import (
    PlateLine,
    SmallTool,
    TipLine,
    ToDoLine,
    ToolEvents,
    ToolFooter,
    ToolTitle,
    ToolView,
)

_COMMANDS: dict[str, ToolCommand] = {"f": Finish(), "n": Again(), "q": Leave()}
ToolSession = GuidedSession[ToolSnapshot, ToolCommand]


class ToolScreen(GuidedScreen[ToolSnapshot]):
    """Both pictures, what to do, what is known."""

    def compose(self) -> ComposeResult:
        """From top to bottom."""
        yield SmallTool("small")
        with Vertical(id="body"):
            yield ToolTitle("title")
            with Horizontal(id="pictures"):
                yield Picture("left")
                yield Picture("right")
            yield ToDoLine("todo")
            yield PlateLine("plate")
            yield TipLine("tip")
            yield ToolEvents("events")
            yield ToolFooter("footer")

    def on_mount(self) -> None:
        """Name the pictures."""
        self.name_pictures()

    def show(self, snapshot: ToolSnapshot, symbols: Symbols) -> None:
        """Pass a snapshot on."""
        self.pass_on(snapshot.pictures, symbols, ToolView(snapshot, symbols))


class ToolApp(GuidedApp[ToolSnapshot, ToolCommand]):
    """The operator's screen for one tool."""

    CSS_PATH = Path(__file__).with_name("tool_calibration.tcss")

    def __init__(
        self,
        session: ToolSession,
        *,
        symbols: Symbols = UNICODE,
        polls_per_s: int = POLLS_PER_S,
    ) -> None:
        super().__init__(session, ToolScreen(), symbols=symbols, polls_per_s=polls_per_s)

    def find_command(self, key: str, snapshot: ToolSnapshot) -> ToolCommand | None:
        """What a key means."""
        return _COMMANDS.get(key)


def run_tool_app(session: ToolSession, log_path: Path) -> int:
    """Run the screen until it ends; see `run_guided_app`."""
    return run_guided_app(lambda symbols: ToolApp(session, symbols=symbols), log_path)
