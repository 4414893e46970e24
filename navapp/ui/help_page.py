"""The help: keys, the legend of the overlay, and what the words on the screen mean."""

import textwrap
from itertools import zip_longest
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.content import Content
from textual.geometry import Size

from navapp.ui.actions import ACTIONS, is_possible
from navapp.ui.layers_page import OverlayLegend
from navapp.ui.pictures.picture_view import NOTICE
from navapp.ui.screens import PageScreen
from navapp.ui.text_view import TextView
from navapp.ui.view import View
from navapp.ui.words import WORDS

_WORD_WIDTH = max(len(word) for word, _ in WORDS)
# The first of several actions -> their keys and what they do, in one line.
_SHARED = {
    "stage-1": ("1 - 5", "go to that stage"),
    "nudge-left": ("arrows", "compare candidates; in the mirror: move the cross"),
}


class KeyTable(TextView):
    """All actions with their keys."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """A line an action; the five stages share one, and so do the arrows."""
        lines = []
        for action in ACTIONS:
            key, text = action.key_label, action.description
            is_now = is_possible(action, view.snapshot, view.is_silent)
            if action.name in _SHARED:
                key, text = _SHARED[action.name]
                is_now = is_now or action.name == "stage-1"
            elif action.name.startswith(("stage-", "nudge-")):
                continue
            text_style = "$foreground" if is_now else "$text-muted"
            note = "" if is_now else "  (not now)"
            lines.append(
                Content.assemble((f" {key:>7}  ", "bold $primary"), (text + note, text_style))
            )
        lines.append(Content.assemble((f" {'ctrl+p':>7}  ", "bold $primary"), "find a command"))
        return [*lines, Content(""), Content.styled(f" {view.title}: {NOTICE}", "$text-muted")]

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """As many lines as there are."""
        return 1 if self._view is None else len(self.build(self._view, width, 0))


class WordTable(TextView):
    """What the words on the screen mean."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Each word, and its meaning on as many lines as it takes."""
        return _explain_words(width)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """As many lines as there are."""
        return len(_explain_words(width))


def _explain_words(width: int) -> list[Content]:
    lines = [Content(""), Content.styled(" the words on the screen", "$text-muted")]
    for word, meaning in WORDS:
        said = textwrap.wrap(meaning, max(width - _WORD_WIDTH - 3, 20))
        lines += [
            Content.assemble((f" {name:<{_WORD_WIDTH}} ", "bold $foreground"), line)
            for name, line in zip_longest([word], said, fillvalue="")
        ]
    return lines


class HelpPage(PageScreen):
    """All keys, from the action table, the words on the screen, the legend of the overlay."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "dismiss", "back", show=False)
    ]

    page_title, keys = "help", " back  arrows, PgDn: the overlay's colours, the words"
    container = VerticalScroll

    def compose_page(self) -> ComposeResult:
        """Keys, legend, words."""
        yield KeyTable("keys")
        yield OverlayLegend("legend")
        yield WordTable("words")
