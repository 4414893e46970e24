"""The last line of a page over the main screen."""

from textual.content import Content

from navapp.ui.text_view import TextView
from navapp.ui.view import View


class PageKeys(TextView):
    """How to leave, and what else can be done here."""

    def __init__(self, text: str) -> None:
        super().__init__("footer")
        self._text = text

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """One line; the display can be blanked from every page."""
        return [
            Content.assemble(
                (" SPACE", "bold $primary"), " blank  ", ("ESC", "bold $primary"), self._text
            )
        ]
