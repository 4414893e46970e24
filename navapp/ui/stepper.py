"""The row of the five stages, with the gate before the next one and what was measured."""

from textual.content import Content

from navapp.control.states import StepLine
from navapp.ui.gauges import cut
from navapp.ui.text_view import TextView
from navapp.ui.view import Level, View
from navapp.values import MeasuredHole, StageSpec


class StageStepper(TextView):
    """One line; with more room also what the next stage asks for, and what was measured."""

    def __init__(self) -> None:
        super().__init__("stepper")

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """The row of stages first."""
        stage, steps = view.snapshot.stage, _steps(view)
        room = max(width - steps.cell_length, 0)
        limits = f"{stage.tolerance_mm:.2f} mm {stage.tolerance_deg:.1f} deg "
        limits = f"limits {limits}" if room >= len(limits) + 10 else limits
        row = Content.assemble(steps, (limits.rjust(room), "$text-muted"))
        if height < 2:
            return [row]
        return [row, _gate_row(view, width), _measured_row(view, width)]


def _gate_row(view: View, width: int) -> Content:
    """What the next stage asks for, each thing met or open."""
    items = [
        f"{(Level.OK if line.is_met else Level.ATTENTION).mark(view.symbols)} {line.text}"
        for line in view.snapshot.gate
    ]
    return _format_row("before the next stage", items, view, width)


def _measured_row(view: View, width: int) -> Content:
    """The steps of the stage that are made, against their plan."""
    items = [f"{step.name} {_say_made(step)}" for step in view.snapshot.steps if step.is_made]
    return _format_row("measured here", items, view, width)


def _say_made(step: StepLine) -> str:
    measured = step.measured
    if isinstance(measured, MeasuredHole):
        return f"{measured.off_mm:.2f} mm"
    if measured is not None:
        return f"{measured.angle_deg:.2f} deg {measured.offset_mm:+.2f} mm"
    return "made" if step.kind == "part" else "not measurable"


def _steps(view: View) -> Content:
    present = view.snapshot.stage.number
    parts: list[Content | str | tuple[str, str]] = [" "]
    for index, stage in enumerate(view.snapshot.stages):
        if index:
            parts.append((f" {view.symbols.dash} ", "$text-muted"))
        parts.append(_step(stage, is_present=stage.number == present))
    return Content.assemble(*parts)


def _step(stage: StageSpec, *, is_present: bool) -> tuple[str, str]:
    name = stage.name.upper() if is_present else stage.name
    return f"{stage.number} {name}", "bold $primary" if is_present else "$text-muted"


def _format_row(name: str, items: list[str], view: View, width: int) -> Content:
    text = f" {view.symbols.dot} ".join(items) or "nothing"
    return Content.assemble((f" {name:<22} ", "$text-muted"), cut(text, width - 25, view.symbols))
