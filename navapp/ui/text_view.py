"""Base of all widgets that show a few lines of text of a fixed place."""

from typing import Generic, TypeVar

from textual.content import Content
from textual.widget import Widget

from navapp.ui.view import View

ShownT = TypeVar("ShownT")


class Lines(Widget, Generic[ShownT]):
    """Builds its lines from the newest of what is shown; repaints only when they differ."""

    def __init__(self, widget_id: str) -> None:
        super().__init__(id=widget_id)
        self._view: ShownT | None = None
        self._shown: Content | None = None

    def show(self, view: ShownT) -> None:
        """Take over what is shown."""
        self._view = view
        width, height = self.content_size
        if width < 1 or height < 1:
            return
        if self._shown is None or not self._shown.is_same(self._content(view, width, height)):
            self.refresh()

    def build(self, view: ShownT, width: int, height: int) -> list[Content]:
        """The lines; those beyond `height` are not seen."""
        raise NotImplementedError

    def _content(self, view: ShownT, width: int, height: int) -> Content:
        return Content("\n").join(self.build(view, width, height)[:height])

    def render(self) -> Content:
        """The lines as one text."""
        width, height = self.content_size
        if self._view is None or width < 1 or height < 1:
            return Content("")
        self._shown = self._content(self._view, width, height)
        return self._shown


class TextView(Lines[View]):
    """Lines of a session's view; never moves."""


def break_line(text: str, width: int) -> tuple[str, str]:
    """The words that fit into a line, and the others."""
    if len(text) <= width:
        return text, ""
    place = text.rfind(" ", 0, max(width, 1) + 1)
    return (text[:width], text[width:]) if place < 1 else (text[:place], text[place + 1 :])
