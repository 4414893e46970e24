"""The lines that stand above the pictures of a live screen during the tutorial."""

from typing import Any

from textual.content import Content

from navapp.ui.capture.panels import CaptureView
from navapp.ui.gauges import cut
from navapp.ui.symbols import Symbols
from navapp.ui.text_view import Lines, TextView, break_line
from navapp.ui.tutorial.guide import Guide
from navapp.ui.view import Level, View

_HEAD = 10  # width of the words before a line
_ID = "tutorial"


class TutorialLines(TextView):
    """Of a session."""

    def __init__(self, guide: Guide[Any]) -> None:
        super().__init__(_ID)
        self._guide = guide

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Three lines."""
        return format_guide(self._guide, width, view.symbols)


class TutorialCaptureLines(Lines[CaptureView]):
    """Of a guided capture."""

    def __init__(self, guide: Guide[Any]) -> None:
        super().__init__(_ID)
        self._guide = guide

    def build(self, view: CaptureView, width: int, height: int) -> list[Content]:
        """Three lines."""
        return format_guide(self._guide, width, view.symbols)


def format_guide(guide: Guide[Any], width: int, symbols: Symbols) -> list[Content]:
    """What was reached, then in two lines what to do now."""
    n_open = guide.n_tasks - guide.n_reached
    room = max(width - _HEAD - guide.n_tasks - 3, 0)
    reached = cut(guide.last_reached, room, symbols)
    first, rest = break_line(guide.now, max(width - _HEAD - 1, 1))
    return [
        Content.assemble(
            (" tutorial ", "bold $primary"),
            (symbols.ok * guide.n_reached, Level.OK.value),
            (symbols.absent * n_open, Level.QUIET.value),
            ("  " + reached, Level.OK.value),
        ),
        Content.assemble((" now      ", "$text-muted"), (first, "bold $foreground")),
        Content.assemble(
            " " * _HEAD, (cut(rest, max(width - _HEAD - 1, 0), symbols), "bold $foreground")
        ),
    ]
