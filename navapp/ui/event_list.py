"""The newest events, newest first."""

from textual.content import Content

from navapp.control.states import Event, EventLevel
from navapp.ui.gauges import cut
from navapp.ui.text_view import TextView
from navapp.ui.view import Level, View, choose_event_level

_WORDS = {EventLevel.INFO: "", EventLevel.WARNING: "WARNING ", EventLevel.ALARM: "ALARM "}


class EventList(TextView):
    """The newest events, as many as fit."""

    def __init__(self) -> None:
        super().__init__("events")

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """One line an event."""
        newest = view.snapshot.events[::-1][:height]
        return [format_event_line(view, event, width) for event in newest]


def format_event_line(view: View, event: Event, width: int) -> Content:
    """Time since the session's start, symbol, word and text."""
    level = choose_event_level(event.level)
    is_quiet = level is Level.QUIET
    mark = " " if is_quiet else level.mark(view.symbols)
    style = "$foreground" if is_quiet else level.value
    head = f" {view.clock(event.time_ns):>6} "
    text = cut(f"{_WORDS[event.level]}{event.text}", max(width - len(head) - 3, 0), view.symbols)
    return Content.assemble((head, "$text-muted"), (f"{mark} {text}", style))
