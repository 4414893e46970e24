"""The main screen: picture, panels, stages, events, keys."""

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.content import Content

from navapp.ui.devices_panel import DevicesPanel
from navapp.ui.event_list import EventList
from navapp.ui.footer import KeyFooter
from navapp.ui.line_panel import LinePanel
from navapp.ui.pictures.picture_view import (
    MOST_CANDIDATES,
    NOTICE,
    CandidateView,
    PictureView,
    ResidualView,
)
from navapp.ui.pose_panel import PosePanel, format_navigable_line, format_reason_lines
from navapp.ui.screens import ViewScreen
from navapp.ui.stepper import StageStepper
from navapp.ui.text_view import TextView
from navapp.ui.title_line import TitleLine
from navapp.ui.view import View
from navapp.ui.work_line import WorkLine


class SmallNotice(TextView):
    """Stands in for everything on a terminal that is too small: the essential, in words."""

    def __init__(self) -> None:
        super().__init__("small")

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Most important line first."""
        return [
            format_navigable_line(view, width),
            *format_reason_lines(view, width),
            Content(f"{'sim, ' if view.snapshot.is_simulated else ''}{_stage_and_state(view)}"),
            Content.assemble(("SPACE", "bold $primary"), " blank"),
            Content.styled("make the terminal 80 x 24", "$text-muted"),
            Content.styled(NOTICE, "$text-muted"),
        ]


def _stage_and_state(view: View) -> str:
    stage = view.snapshot.stage
    return f"stage {stage.number} {stage.name}, {view.state_word.lower()}"


class MainScreen(ViewScreen[None]):
    """What the operator sees most of the time."""

    def show(self, view: View, *, is_text_due: bool) -> None:
        """Several candidates need room to be compared."""
        self.set_class(len(view.snapshot.candidates) > 1, "-compared")
        super().show(view, is_text_due=is_text_due)

    def compose(self) -> ComposeResult:
        """From top to bottom."""
        yield SmallNotice()
        with Vertical(id="body"):
            yield TitleLine()
            with Horizontal(id="middle"):
                yield PictureView()
                yield ResidualView()
                with Vertical(id="panels"):
                    yield PosePanel()
                    yield LinePanel()
                    yield DevicesPanel()
            with Horizontal(id="candidates"):
                yield from (CandidateView(index) for index in range(MOST_CANDIDATES))
            yield StageStepper()
            yield WorkLine()
            yield EventList()
            yield KeyFooter()
