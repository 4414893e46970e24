"""The page of the stage's steps: which are made, and what was measured against plan."""

from collections.abc import Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content

from navapp.control.states import Snapshot, StepLine
from navapp.resection import Thickness
from navapp.resection.cut_bone import UNSURE_MM
from navapp.ui.gauges import draw_bar
from navapp.ui.screens import PageScreen
from navapp.ui.symbols import Symbols
from navapp.ui.text_view import TextView
from navapp.ui.view import View
from navapp.values import MeasuredFace, MeasuredHole, StageSpec
from navapp.values.faces import LEAST_SHARE

# The steps of a stage in their order.
STEP_KEYS = "bcdfghijmnopstuw"
_NAME_WIDTH, _BAR_WIDTH = 24, 10


class StepTable(TextView):
    """All cuts, holes and parts of the stage with their letters."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """A line a step, and more where it was measured or looked for."""
        snapshot, lines = view.snapshot, list[Content]()
        if not snapshot.steps:
            return [Content(f" the plan has no cut, hole or part of the {snapshot.stage.bone}")]
        more = max(len(snapshot.steps) - len(STEP_KEYS), 0)
        for key, step in zip(STEP_KEYS + more * " ", snapshot.steps, strict=False):
            word = f"{step.kind:<5}{'made' if step.is_made else 'planned'}"
            lines.append(
                Content.assemble(
                    (f" {key}  ", "bold $primary"), f"{step.name:<{_NAME_WIDTH}} {word}"
                )
            )
            lines += _tell_made(step, snapshot.stage, view.symbols)
        if more:
            lines.append(
                Content.styled(
                    f" {more} steps have no letter: confirm them in a script", "$warning"
                )
            )
        version = f" version {snapshot.bone_version} of the {snapshot.stage.bone} is in force"
        notes = (
            version,
            f" Bone beyond a cut, in a hole or below a part no longer counts, nor {UNSURE_MM} mm",
            " beside a cut until its face is measured.",
            " +- is the 95 % bound, that of the pose in it.",
        )
        return [*lines, Content(""), *(Content.styled(note, "$text-muted") for note in notes)]


def _tell_made(step: StepLine, stage: StageSpec, symbols: Symbols) -> list[Content]:
    """What is known of a cut or a hole that was made."""
    if step.kind == "part" or not step.is_made:
        return []
    if isinstance(step.measured, MeasuredHole):
        return _tell_hole(step.measured, stage, symbols)
    if step.is_caliper_readable:
        return _tell_caliper(step)
    if step.caliper_refusal:
        return [Content.styled(f"      not tracked: {step.caliper_refusal}", "$warning")]
    if step.measured is not None:
        return [*_tell_measured(step.measured, stage, symbols), *_tell_thickness(step.thickness)]
    seen = "it is not seen, or was not looked for yet"
    if step.seen_share is not None:
        seen = f"{100.0 * step.seen_share:.0f} % of the {step.kind} is seen"
        seen += "" if step.seen_share < LEAST_SHARE else ", its bounds are too large"
    return [Content.styled(f"      not measurable: {seen}", "$warning")]


def _tell_measured(face: MeasuredFace, stage: StageSpec, symbols: Symbols) -> list[Content]:
    tilt = f"{face.angle_deg:.2f}", face.angle_deg, face.bound_deg, stage.tolerance_deg
    offset = f"{face.offset_mm:+.2f}", face.offset_mm, face.bound_mm, stage.tolerance_mm
    return [_row("tilt", *tilt, "deg", symbols), _row("offset", *offset, "mm", symbols)]


def _tell_thickness(thickness: Thickness | None) -> list[Content]:
    if thickness is None:
        return []
    told = f"      thick  {thickness.mm:6.2f} mm   +-{thickness.bound_mm:5.2f}"
    return [Content(f"{told}  planned {thickness.planned_mm:.2f}")]


def _tell_caliper(step: StepLine) -> list[Content]:
    """What remains below a cut, as it was read, or what is to be read."""
    names = [point.name for point in step.caliper_points]
    planned_mm = [point.thickness_mm for point in step.caliper_points]

    def tell(values_mm: Sequence[float]) -> str:
        return ", ".join(f"{a} {b:.1f}" for a, b in zip(names, values_mm, strict=True))

    planned = Content(f"      remaining as planned: {tell(planned_mm)}")
    if not step.remaining_mm:
        asked = "      not tracked until its remaining thickness is read (r), in mm"
        return [Content.styled(asked, "$warning"), planned]
    read = Content(f"      remaining as read (r: again): {tell(step.remaining_mm)}")
    removed = step.thickness
    if removed is None:
        return [read, planned]
    told = f"      removed {removed.mm:.2f} mm +-{removed.bound_mm:.2f}"
    return [read, planned, Content(f"{told}, planned {removed.planned_mm:.2f}")]


def _tell_hole(hole: MeasuredHole, stage: StageSpec, symbols: Symbols) -> list[Content]:
    off = f"{hole.off_mm:.2f}", hole.off_mm, hole.bound_mm, stage.tolerance_mm
    wide = f"      width  {hole.diameter_mm:6.2f} mm   +-{hole.diameter_bound_mm:5.2f}"
    wide += f"  drill {hole.drill.diameter_mm:.1f}"
    return [_row("entry", *off, "mm", symbols), Content(wide)]


def _row(
    what: str,
    told: str,
    value: float,
    bound: float,
    tolerance: float,
    unit: str,
    symbols: Symbols,
) -> Content:
    """A measurement with its bound and a bar of its tolerance."""
    return Content.assemble(
        f"      {what:<7}{told:>6} {unit:<4}+-{bound:5.2f}  ",
        (draw_bar(abs(value), tolerance, _BAR_WIDTH, symbols), _style(value, bound, tolerance)),
        (f"  tolerance {tolerance:.1f}", "$text-muted"),
    )


def _style(value: float, bound: float, tolerance: float) -> str:
    """Within the tolerance for sure, perhaps, or not."""
    if abs(value) + bound <= tolerance:
        return "$success"
    return "$warning" if abs(value) - bound <= tolerance else "$error"


def step_of_key(snapshot: Snapshot, key: str) -> str | None:
    """The name of the step that a letter of the page means; None: it means nothing."""
    number = STEP_KEYS.index(key)
    return snapshot.steps[number].name if number < len(snapshot.steps) else None


class StepsPage(PageScreen):
    """Steps, confirmed and withdrawn by their letters."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("k", "dismiss", "back", show=False),
        Binding("r", "app.read_thickness", "thickness", show=False),
        *(Binding(key, f"app.confirm_step('{key}')", "made", show=False) for key in STEP_KEYS),
        *(
            Binding(key.upper(), f"app.withdraw_step('{key}')", "not made", show=False)
            for key in STEP_KEYS
        ),
    ]

    page_title = "steps of the stage"
    keys = " back  letter: made  capital: not made after all  r thickness"

    def compose_page(self) -> ComposeResult:
        """Steps."""
        yield StepTable("steps")
