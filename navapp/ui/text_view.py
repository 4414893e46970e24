"""Base of all widgets that show a few lines of text of a fixed place."""

from textual.content import Content
from textual.widget import Widget

from navapp.ui.view import View


class TextView(Widget):
    """Builds its lines from the newest view; repaints only when they differ; never moves."""

    def __init__(self, widget_id: str) -> None:
        super().__init__(id=widget_id)
        self._view: View | None = None
        self._shown: Content | None = None

    def show(self, view: View) -> None:
        """Take over a view."""
        self._view = view
        width, height = self.content_size
        if width < 1 or height < 1:
            return
        if self._shown is None or not self._shown.is_same(self._content(view, width, height)):
            self.refresh()

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """The lines; those beyond `height` are not seen."""
        raise NotImplementedError

    def _content(self, view: View, width: int, height: int) -> Content:
        return Content("\n").join(self.build(view, width, height)[:height])

    def render(self) -> Content:
        """The lines as one text."""
        width, height = self.content_size
        if self._view is None or width < 1 or height < 1:
            return Content("")
        self._shown = self._content(self._view, width, height)
        return self._shown
