"""The progress line of long work: what, how far, and how to cancel."""

import math

from textual.content import Content

from navapp.control.states import SessionState
from navapp.ui.gauges import Number, cut, draw_fraction_bar
from navapp.ui.text_view import TextView
from navapp.ui.view import Level, View

_BAR_WIDTH = 26


class WorkLine(TextView):
    """Progress of long work; empty, but in place, when there is none."""

    def __init__(self) -> None:
        super().__init__("work")

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Silence of the session goes before progress."""
        progress = view.snapshot.progress
        if view.is_silent:
            text = (
                f" {view.symbols.bad} The session gives no answer; nothing shown here is current."
            )
            return [Content.styled(cut(text, width, view.symbols), Level.BAD.value)]
        if progress is None:
            return [Content("")]
        is_cancellable = view.snapshot.state is SessionState.REGISTERING
        hint = "  c cancel" if is_cancellable else ""
        if math.isnan(progress.share):
            what = cut(progress.what, max(width - len(hint) - 1, 0), view.symbols)
            return [Content.assemble(f" {what}", (hint, "bold $foreground"))]
        room = max(width - _BAR_WIDTH - len(hint) - 9, 0)
        return [
            Content.assemble(
                f" {cut(progress.what, room, view.symbols):<{room}} ",
                (draw_fraction_bar(progress.share, _BAR_WIDTH, view.symbols), "$primary"),
                f" {Number.PERCENT.text(100.0 * progress.share)} %",
                (hint, "bold $foreground"),
            )
        ]
