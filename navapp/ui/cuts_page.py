"""The page of the stage's cuts: which are made, and what of them was measured against plan."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content

from navapp.control.states import CutLine, Snapshot
from navapp.resection.cut_bone import UNSURE_MM
from navapp.ui.gauges import draw_bar
from navapp.ui.screens import PageScreen
from navapp.ui.symbols import Symbols
from navapp.ui.text_view import TextView
from navapp.ui.view import View
from navapp.values import MeasuredFace, StageSpec
from navapp.values.faces import LEAST_SHARE

# The cuts of a stage in their order.
CUT_KEYS = "bcdfghijmnopstuw"
_NAME_WIDTH, _BAR_WIDTH = 24, 10


class CutTable(TextView):
    """All cuts of the stage with their letters."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """A line a cut, and a second one where its face was measured or looked for."""
        snapshot, lines = view.snapshot, list[Content]()
        if not snapshot.cuts:
            return [Content(f" the plan has no cuts of the {snapshot.stage.bone}")]
        for key, cut in zip(CUT_KEYS, snapshot.cuts, strict=False):
            word = "made" if cut.is_made else "planned"
            lines.append(
                Content.assemble(
                    (f" {key}  ", "bold $primary"), f"{cut.name:<{_NAME_WIDTH}} {word}"
                )
            )
            lines += _tell_face(cut, snapshot.stage, view.symbols)
        version = f" version {snapshot.bone_version} of the {snapshot.stage.bone} is in force"
        notes = (
            version,
            f" Bone beyond a cut that is made no longer counts, nor {UNSURE_MM} mm beside it",
            " until its face is measured. +- is the 95 % bound, that of the pose in it.",
        )
        return [*lines, Content(""), *(Content.styled(note, "$text-muted") for note in notes)]


def _tell_face(cut: CutLine, stage: StageSpec, symbols: Symbols) -> list[Content]:
    """What is known of a face that was made."""
    if not cut.is_made:
        return []
    if cut.face is not None:
        return _tell_measured(cut.face, stage, symbols)
    seen = "it is not seen, or was not looked for yet"
    if cut.seen_share is not None:
        seen = f"{100.0 * cut.seen_share:.0f} % of the cut is seen"
        seen += "" if cut.seen_share < LEAST_SHARE else ", its bounds are too large"
    return [Content.styled(f"      not measurable: {seen}", "$warning")]


def _tell_measured(face: MeasuredFace, stage: StageSpec, symbols: Symbols) -> list[Content]:
    rows = (
        (
            "tilt",
            f"{face.angle_deg:.2f}",
            face.angle_deg,
            face.bound_deg,
            stage.tolerance_deg,
            "deg",
        ),
        (
            "offset",
            f"{face.offset_mm:+.2f}",
            face.offset_mm,
            face.bound_mm,
            stage.tolerance_mm,
            "mm",
        ),
    )
    return [
        Content.assemble(
            f"      {what:<7}{told:>6} {unit:<4}+-{bound:5.2f}  ",
            (draw_bar(abs(value), tolerance, _BAR_WIDTH, symbols), _style(value, bound, tolerance)),
            (f"  tolerance {tolerance:.1f}", "$text-muted"),
        )
        for what, told, value, bound, tolerance, unit in rows
    ]


def _style(value: float, bound: float, tolerance: float) -> str:
    """Within the tolerance for sure, perhaps, or not."""
    if abs(value) + bound <= tolerance:
        return "$success"
    return "$warning" if abs(value) - bound <= tolerance else "$error"


def cut_of_key(snapshot: Snapshot, key: str) -> CutLine | None:
    """The cut that a letter of the page means."""
    number = CUT_KEYS.index(key)
    return snapshot.cuts[number] if number < len(snapshot.cuts) else None


class CutsPage(PageScreen):
    """Cuts, confirmed and withdrawn by their letters."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("k", "dismiss", "back", show=False),
        *(Binding(key, f"app.change_cut('{key}')", f"cut {key}", show=False) for key in CUT_KEYS),
    ]

    page_title, keys = (
        "cuts of the stage",
        " back  a letter: that cut has been made, or has not been made after all",
    )

    def compose_page(self) -> ComposeResult:
        """Cuts."""
        yield CutTable("cuts")
