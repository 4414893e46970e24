"""Asks what a caliper reads below a cut."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Static

from navapp.control.states import StepLine
from navapp.ui.screens import ViewScreen
from navapp.ui.view import View

Reading = tuple[float, ...]


class ThicknessQuestion(ViewScreen[Reading | None], ModalScreen[Reading | None]):
    """A dialog that asks for one reading (mm) for each caliper point, with commas between them."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss(None)", "back", show=False),
    ]

    def __init__(self, view: View, step: StepLine) -> None:
        super().__init__(view)
        self._step = step

    def compose(self) -> ComposeResult:
        """A box over the page."""
        points = self._step.caliper_points
        names = ", ".join(point.name for point in points)
        planned = ",".join(f"{point.thickness_mm:.1f}" for point in points)
        with Vertical(id="thickness"):
            yield Static(f"What does the caliper read below {self._step.name}, in mm?")
            yield Static(f"{names}: numbers with commas between them")
            yield Input(placeholder=f"planned: {planned}", restrict=r"[0-9.,]*")
            yield Static("ENTER takes them  ESC back", id="thickness-hint")

    def on_mount(self) -> None:
        """Ready to type."""
        super().on_mount()
        self.query_one(Input).focus()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Answer, or say what is wrong."""
        reading = _parse(event.value)
        n_points = len(self._step.caliper_points)
        if len(reading) == n_points:
            self.dismiss(reading)
            return
        told = f"{n_points} numbers are needed, with commas between them"
        self.query_one("#thickness-hint", Static).update(told)


def _parse(text: str) -> Reading:
    """The numbers of a text; empty when a word is no number."""
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        return ()
