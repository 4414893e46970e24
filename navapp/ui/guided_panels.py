"""Lines that the screens of all guided sessions have: title, events, keys."""

from collections.abc import Sequence

from textual.content import Content

from navapp.ui.gauges import cut
from navapp.ui.symbols import Symbols

TOO_SMALL = Content.styled("make the terminal 80 x 24", "$text-muted")
Parts = list[str | Content | tuple[str, str]]


def format_title(verb: str, device: str, right: Content, width: int, *, is_sim: bool) -> Content:
    """Verb and device at the left, how it stands at the right."""
    left = Content.assemble(
        (f" navapp {verb} ", "bold $primary"),
        (" sim " if is_sim else "", "bold $background on $warning"),
        f" {device}",
    )
    room = max(width - right.cell_length, 0)
    return Content.assemble(left.truncate(room).pad_right(max(room - left.cell_length, 0)), right)


def format_events(
    events: Sequence[str], width: int, height: int, symbols: Symbols
) -> list[Content]:
    """Newest first, as many as there is room for."""
    newest = list(reversed(events))[:height]
    return [Content.styled(cut(text, width, symbols), "$text-muted") for text in newest]


def format_key(shown: str, label: str, is_possible: bool = True) -> Parts:
    """A key and its word; dimmed when it cannot be used now."""
    if not is_possible:
        return [(f" {shown} {label} ", "$text-disabled")]
    return [(f" {shown} ", "bold $primary"), (f"{label} ", "$foreground")]
