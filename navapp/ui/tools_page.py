"""The page of the tools: how they stand to bone and plan, and the check on the patient."""

from dataclasses import replace
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.content import Content

from navapp.control.interlocks import is_tool_current
from navapp.control.states import PatientCheck, Snapshot, ToolLine, ToolReading
from navapp.tools.patient_check import CheckAnswer
from navapp.ui.gauges import Number, draw_bar
from navapp.ui.pictures.picture_view import PictureView
from navapp.ui.screens import PageScreen
from navapp.ui.text_view import TextView
from navapp.ui.view import Level, View
from navapp.values import StageSpec

LANDMARK_KEYS = "bcdfghijklm"
_BAR_WIDTH = 10
_NO_TOOLS = (
    " no tool is known",
    " calibrate one: navapp calibrate pivot --out pointer.json",
    ' and name it:   [tools] pointer = "pointer.json"',
    " without one, landmarks picked in the picture (p, then k) can find an error",
)
_ANSWERS = {
    CheckAnswer.OPEN: Level.ATTENTION,
    CheckAnswer.PASSED: Level.OK,
    CheckAnswer.FAILED: Level.BAD,
    CheckAnswer.CANNOT_TELL: Level.ATTENTION,
}


class ToolTable(TextView):
    """Tools first, then the check on the patient, then the landmarks with their letters."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """As many lines as there are."""
        snapshot = view.snapshot
        if snapshot.tools:
            lines = [line for tool in snapshot.tools for line in _tell_tool(tool, view)]
        else:
            lines = [Content.styled(line, "$text-muted") for line in _NO_TOOLS]
        lines += [Content(""), *_tell_check(snapshot, view), Content("")]
        return [*lines, *_tell_landmarks(snapshot)]


def _tell_tool(tool: ToolLine, view: View) -> list[Content]:
    reading = tool.reading
    is_there = reading is not None and is_tool_current(tool) and not view.is_silent
    level = Level.OK if is_there else Level.ATTENTION
    head = f" {level.mark(view.symbols)} {tool.kind:<8}"
    if reading is None or not is_there:
        return [Content.assemble((head, level.value), tool.missing or "not seen lately")]
    age = "" if tool.age_ms is None else f"{tool.age_ms:.0f} ms old"
    seen = f"{100.0 * reading.seen.seen_share:.0f} % of its plate seen, {age}"
    lines = [Content.assemble((head, level.value), (seen, "$text-muted"))]
    if reading.placed is None:
        return [*lines, Content("   the bone is not OK: no place on it is known")]
    return lines + _tell_reading(reading, view)


def _tell_reading(reading: ToolReading, view: View) -> list[Content]:
    placed, stage = reading.placed, view.snapshot.stage
    if placed is None:
        return []
    surface = "-" if reading.surface_mm is None else f"{reading.surface_mm:+.2f}"
    bound = f"{view.symbols.at_most}{placed.bound_mm:.2f}"
    lines = [Content.assemble(f"   surface {surface:>7} mm ", (bound, "$text-muted"))]
    if reading.nearest is not None:
        name, away_mm = reading.nearest
        lines.append(Content(f"   {_short(name)} {away_mm:.1f} mm away"))
    if reading.hole is not None:
        hole = reading.hole
        lines.append(Content(f"   hole {hole.name}"))
        lines.append(_row("off line", hole.off_mm, placed.bound_mm, "mm", stage, view))
        if hole.angle_deg is not None and hole.bound_deg is not None:
            lines.append(_row("angle", hole.angle_deg, hole.bound_deg, "deg", stage, view))
        lines.append(Content(f"   depth    {hole.depth_mm:+6.2f} mm"))
    return lines


def _row(what: str, value: float, bound: float, unit: str, stage: StageSpec, view: View) -> Content:
    """Against the stage's tolerance, with a bar of it."""
    limit = stage.tolerance_mm if unit == "mm" else stage.tolerance_deg
    style = "$success" if value + bound <= limit else "$warning"
    style = style if value - bound <= limit else "$error"
    return Content.assemble(
        f"   {what:<9}{value:6.2f} {unit:<3} ",
        (draw_bar(value, limit, _BAR_WIDTH, view.symbols), style),
        (f" {view.symbols.at_most}{bound:.2f}, {limit:.1f} allowed", "$text-muted"),
    )


def _tell_check(snapshot: Snapshot, view: View) -> list[Content]:
    check = snapshot.patient_check
    title = Content.styled(" check on the patient", "bold $foreground")
    if check is None or not check.is_valid or check.n_touches == 0:
        todo = Content("   touch the bone with the pointer's tip, keep it still, press ENTER")
        if check is None or not check.has_failed:
            return [title, todo]
        failed = f"   {Level.BAD.mark(view.symbols)} a check of this registration failed"
        return [title, Content.styled(failed, Level.BAD.value), todo]
    level = _ANSWERS[check.answer]
    word = f"   {level.mark(view.symbols)} {check.n_touches} points: {check.answer.value}"
    lines = [title, Content.styled(word, level.value), *_tell_result(check, view)]
    if check.wanted:
        lines.append(Content(f"   touch next {check.wanted}"))
    return lines


def _tell_result(check: PatientCheck, view: View) -> list[Content]:
    result = check.result
    if result is None:
        return []
    bar = draw_bar(result.most_mm, result.limit_mm, _BAR_WIDTH, view.symbols)
    style = "$success" if result.most_mm <= result.limit_mm else "$warning"
    lines = [
        Content.assemble(
            f"   {Number.MM.text(result.measured_mm)} mm off ",
            (bar, style),
            (f" {result.least_mm:.2f} to {result.most_mm:.2f}", "$text-muted"),
            (f", {result.limit_mm:.1f} allowed", "$text-muted"),
        )
    ]
    if result.reason:
        lines.append(Content.styled(f"   {result.reason}", "$warning"))
    if result.size_note:
        lines.append(Content.styled(f"   {result.size_note}", "$text-muted"))
    return lines


def _tell_landmarks(snapshot: Snapshot) -> list[Content]:
    if not snapshot.landmarks:
        return []
    lines = [Content.styled(" or touch a landmark, and press its letter", "$text-muted")]
    for key, name in zip(LANDMARK_KEYS, snapshot.landmarks, strict=False):
        lines.append(Content.assemble((f"   {key}  ", "bold $primary"), _short(name)))
    return lines


def _short(name: str) -> str:
    return name.split("/")[-1].replace("_", " ")


def landmark_of_key(snapshot: Snapshot, key: str) -> str | None:
    """The landmark that a letter of the page means; None: it means nothing."""
    names = list(snapshot.landmarks)
    number = LANDMARK_KEYS.index(key)
    return names[number] if number < len(names) else None


class ToolsPage(PageScreen):
    """Picture and table; points are taken by ENTER and by the landmarks' letters."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("u", "dismiss", "back", show=False),
        Binding("enter", "app.touch_point('')", "take a point", show=False),
        Binding("x", "app.drop_point", "forget the last", show=False),
        Binding("n", "app.forget_points", "begin anew", show=False),
        *(
            Binding(key, f"app.touch_landmark('{key}')", "touch", show=False)
            for key in LANDMARK_KEYS
        ),
    ]

    page_title, keys = (
        "tools, and the check on the patient",
        " back  ENTER point  letter: a landmark  x drop the last  n anew",
    )

    def show(self, view: View, *, is_text_due: bool) -> None:
        """Around the bone: there the cross is."""
        super().show(replace(view, is_near=True), is_text_due=is_text_due)

    def compose_page(self) -> ComposeResult:
        """Picture and table."""
        with Horizontal(id="tools-and-picture"):
            yield PictureView()
            yield ToolTable("tools")
