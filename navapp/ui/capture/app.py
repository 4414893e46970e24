"""The application of a guided capture."""

from collections.abc import Callable
from pathlib import Path

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical

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
from navapp.ui.guided_app import (
    POLLS_PER_S,
    GuidedApp,
    GuidedScreen,
    GuidedSession,
    run_guided_app,
)
from navapp.ui.pictures.picture import Picture
from navapp.ui.symbols import UNICODE, Symbols

_KEYS = {key.key: key for key in KEYS}
CaptureSession = GuidedSession[CaptureSnapshot, CaptureCommand]


class CaptureScreen(GuidedScreen[CaptureSnapshot]):
    """Both pictures, what is wanted, what is kept."""

    def compose(self) -> ComposeResult:
        """From top to bottom."""
        yield SmallCapture("small")
        with Vertical(id="body"):
            yield CaptureTitle("title")
            with Horizontal(id="pictures"):
                yield Picture("left")
                yield Picture("right")
            yield InstructionLines("wish")
            yield CheckLine("checks")
            yield GaugeLine("gauge")
            with Horizontal(id="kept"):
                yield CoverageMap("coverage")
                yield CaptureEvents("events")
            yield CaptureFooter("footer")

    def on_mount(self) -> None:
        """Name the pictures."""
        self.name_pictures()

    def show(self, snapshot: CaptureSnapshot, symbols: Symbols) -> None:
        """Pass a snapshot on."""
        self.pass_on(snapshot.pictures, symbols, CaptureView(snapshot, symbols))


class CaptureApp(GuidedApp[CaptureSnapshot, CaptureCommand]):
    """The operator's screen for one capture."""

    CSS_PATH = Path(__file__).with_name("capture.tcss")

    def __init__(
        self,
        session: CaptureSession,
        *,
        symbols: Symbols = UNICODE,
        polls_per_s: int = POLLS_PER_S,
    ) -> None:
        super().__init__(session, CaptureScreen(), symbols=symbols, polls_per_s=polls_per_s)

    def find_command(self, key: str, snapshot: CaptureSnapshot) -> CaptureCommand | None:
        """What the table of keys says, when it makes sense now."""
        found = _KEYS.get(key)
        if found is None or not is_possible(found, snapshot):
            return None
        return command_of(found, snapshot)


def run_capture_app(
    session: CaptureSession,
    log_path: Path,
    make_app: Callable[..., CaptureApp] = CaptureApp,
) -> int:
    """Run the screen until it ends; see `run_guided_app`."""
    return run_guided_app(lambda symbols: make_app(session, symbols=symbols), log_path)
