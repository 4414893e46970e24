"""Base of the screens: each passes views on to its widgets."""

from typing import ClassVar, Generic, TypeVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.screen import ModalScreen, Screen

from navapp.ui.page_keys import PageKeys
from navapp.ui.pictures.picture_view import CandidateView, PictureView, ResidualView
from navapp.ui.text_view import TextView
from navapp.ui.title_line import TitleLine
from navapp.ui.view import View

ResultT = TypeVar("ResultT")


class ViewScreen(Screen[ResultT], Generic[ResultT]):
    """A screen that shows views; the first at once when it appears.

    Laid out for 80 x 24 and for wide terminals by the style sheet.
    """

    HORIZONTAL_BREAKPOINTS = [  # noqa: RUF012 (as the base class has it)
        (0, "-narrow"),
        (80, "-enough"),
        (140, "-wide"),
    ]
    VERTICAL_BREAKPOINTS = [  # noqa: RUF012
        (0, "-low"),
        (24, "-even"),
        (40, "-tall"),
    ]

    def __init__(self, view: View) -> None:
        super().__init__()
        self.view = view

    def on_mount(self) -> None:
        """Plain frames where the terminal draws no others."""
        self.set_class(self.view.symbols.is_ascii, "-ascii")
        self.show(self.view, is_text_due=True)

    def show(self, view: View, *, is_text_due: bool) -> None:
        """Pass a view on; text only when it is due, the picture always."""
        self.view = view
        pictures = (*self.query(PictureView), *self.query(ResidualView), *self.query(CandidateView))
        for picture in pictures:
            picture.show(view)
        if is_text_due:
            for widget in self.query(TextView):
                widget.show(view)


class PageScreen(ViewScreen[None], ModalScreen[None]):
    """A page over the main screen: keys of the main screen rest, except those for everywhere."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q", "dismiss", "back", show=False),
    ]

    page_title: ClassVar[str]
    keys: ClassVar[str]  # what else can be done here, in the last line
    container: ClassVar[type[Vertical | VerticalScroll]] = Vertical

    def compose(self) -> ComposeResult:
        """Title, what the page shows, last line."""
        yield TitleLine()
        with self.container(classes="page") as page:
            page.border_title = self.page_title
            yield from self.compose_page()
        yield PageKeys(self.keys)

    def compose_page(self) -> ComposeResult:
        """Each page its own."""
        raise NotImplementedError
