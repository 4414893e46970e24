"""The application of the alignment of crosses."""

from pathlib import Path

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical

from navapp.control.mirror_alignment.states import AlignmentCommand, AlignmentSnapshot, Leave
from navapp.ui.guided_app import (
    POLLS_PER_S,
    GuidedApp,
    GuidedScreen,
    GuidedSession,
    run_guided_app,
)
from navapp.ui.mirror_alignment.keys import KEYS, command_of, is_possible
from navapp.ui.mirror_alignment.panels import (
    AlignmentEvents,
    AlignmentFooter,
    AlignmentTitle,
    AlignmentView,
    CrossLine,
    ErrorLine,
    InstructionLines,
    SmallAlignment,
    UsedMap,
)
from navapp.ui.pictures.picture import Picture
from navapp.ui.symbols import UNICODE, Symbols
from navapp.ui.text_view import Lines

_KEYS = {key.key: key for key in KEYS}
AlignmentSession = GuidedSession[AlignmentSnapshot, AlignmentCommand]


class AlignmentScreen(GuidedScreen[AlignmentSnapshot]):
    """The corner in the camera's picture, what the eye sees, what is next, what was made."""

    def compose(self) -> ComposeResult:
        """From top to bottom."""
        yield SmallAlignment("small")
        with Vertical(id="body"):
            yield AlignmentTitle("title")
            with Horizontal(id="pictures"):
                yield Picture("first")
                yield Picture("second")
            yield InstructionLines("next")
            yield CrossLine("cross")
            yield ErrorLine("error")
            with Horizontal(id="made"):
                yield UsedMap("used")
                yield AlignmentEvents("events")
            yield AlignmentFooter("footer")

    def show(self, snapshot: AlignmentSnapshot, symbols: Symbols) -> None:
        """Pass a snapshot on."""
        first, second = (self.query_one(f"#{name}", Picture) for name in ("first", "second"))
        row, column = snapshot.row_column
        corner = "no corner" if snapshot.corner is None else f"row {row}, column {column}"
        first.border_title = f"left camera: {corner}"
        second.border_title = "what the eye sees" if snapshot.has_eye else "right camera"
        pictures = snapshot.pictures or (None, None)
        for widget, picture in zip((first, second), pictures, strict=True):
            widget.show_picture(picture, symbols.ramp)
        view = AlignmentView(snapshot, symbols)
        for lines in self.query(Lines):
            lines.show(view)


class AlignmentApp(GuidedApp[AlignmentSnapshot, AlignmentCommand]):
    """The operator's screen for one calibration of the mirror."""

    CSS_PATH = Path(__file__).with_name("alignment.tcss")

    def __init__(
        self,
        session: AlignmentSession,
        *,
        symbols: Symbols = UNICODE,
        polls_per_s: int = POLLS_PER_S,
    ) -> None:
        super().__init__(session, AlignmentScreen(), symbols=symbols, polls_per_s=polls_per_s)

    def find_command(self, key: str, snapshot: AlignmentSnapshot) -> AlignmentCommand | None:
        """What the table of keys says, when it makes sense now."""
        found = _KEYS.get(key)
        if found is None or not is_possible(found, snapshot):
            return None
        if self._guided_screen.is_small and found.command != Leave():
            # Nobody sees there what a key would do to a cross.
            return None
        return command_of(found, snapshot)


def run_alignment_app(session: AlignmentSession, log_path: Path) -> int:
    """Run the screen until it ends; see `run_guided_app`."""
    return run_guided_app(lambda symbols: AlignmentApp(session, symbols=symbols), log_path)
