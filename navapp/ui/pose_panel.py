"""The pose panel: whether guides may be shown; if not, the reason and a remedy."""

import textwrap

from textual.content import Content

from navapp.control.commands import Accept
from navapp.control.interlocks import is_current, is_too_slow
from navapp.control.rules import why_refused
from navapp.control.states import OtherBone, Snapshot
from navapp.ui.gauges import Number, draw_bar
from navapp.ui.limb_lines import format_limb_lines
from navapp.ui.text_view import TextView
from navapp.ui.view import Level, View
from navapp.values import Status

# Lines at the bottom that the error with its bar always takes.
_GAUGE_LINES = 2

_STATUS_LEVELS = {
    Status.OK: Level.OK,
    Status.DEGRADED: Level.ATTENTION,
    Status.LOST: Level.BAD,
}


class PosePanel(TextView):
    """Whether guides may be shown, figures or the reason, and the error against its limit.

    Above the error a line for each other bone that is followed: rms figures make room for them, a
    reason or a question to the operator does not. Angles and gaps of the limb, where femur and
    tibia are both followed, come before how much is seen.
    """

    def __init__(self) -> None:
        super().__init__("pose")
        self.border_title = "pose"

    def show(self, view: View) -> None:
        """Say in the frame whose figures these are."""
        title = _title(view.snapshot)
        if self.border_title != title:
            self.border_title = title
        super().show(view)

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """All lines, the gauge at the bottom."""
        if view.snapshot.is_candidate:
            needed, more = _candidate(view, width), list[Content]()
        else:
            needed, more = _middle(view, width)
        room = max(height - 1 - _GAUGE_LINES, 0)
        needed = needed[:room]
        others = [_other(view, other, width) for other in view.snapshot.others]
        others = others[: room - len(needed)]
        more = more[: room - len(needed) - len(others)]
        free = [Content("")] * (room - len(needed) - len(more) - len(others))
        above = [format_navigable_line(view, width), *needed, *more, *free]
        return [*above, *others, *_error(view, width)]


def format_navigable_line(view: View, width: int) -> Content:
    """The filled line that says yes or no."""
    word = "yes" if view.is_navigable else "NO"
    more = len(view.snapshot.reasons) - 1
    hint = (
        f"+{more} more"
        if more > 0 and not view.is_silent and not view.snapshot.is_candidate
        else ""
    )
    text = f" {view.level.mark(view.symbols)} NAVIGABLE  {word}"
    return Content.styled(f"{text}{hint.rjust(width - len(text) - 1)} "[:width], view.level.band)


def format_reason_lines(view: View, width: int) -> list[Content]:
    """The first reason and its remedy, wrapped, with a free column at the right."""
    problem, remedy = view.reason
    room = max(width - 1, 1)
    lines = [Content.styled(line, view.level.value) for line in textwrap.wrap(problem, room)]
    return lines + [Content(line) for line in textwrap.wrap(remedy, room)]


def _other_reasons(view: View, width: int) -> list[Content]:
    """Seen where there is room."""
    others = () if view.is_silent else view.snapshot.reasons[1:]
    texts = [
        line for reason in others for line in textwrap.wrap(f"also: {reason.value}", width - 1)
    ]
    return [Content.styled(text, "$text-muted") for text in texts]


def _middle(view: View, width: int) -> tuple[list[Content], list[Content]]:
    """What must be read, and what may be left out."""
    if not view.is_navigable:
        return format_reason_lines(view, width), _other_reasons(view, width)
    snapshot = view.snapshot
    age = _figure("age", Number.WHOLE, snapshot.pose_age_ms, "ms")
    seen = [
        _figure("seen", Number.WHOLE, _compute_seen_percent(snapshot), "%"),
        _figure("occluded", Number.WHOLE, _compute_occluded_percent(snapshot), "%"),
    ]
    limb = format_limb_lines(view, width)
    if limb:
        return [age], [*limb, *seen, *_fit(snapshot)]
    needed = [Content(""), age, *seen]
    if snapshot.mirror_error is not None:
        # Of what is seen: with the calibration of the mirror, and an eye beside its place.
        needed.append(_figure("in mirror", Number.MM, snapshot.mirror_error.bound_mm, "mm"))
    return needed, _fit(snapshot)


def _other(view: View, other: OtherBone, width: int) -> Content:
    """Another bone: name, mark, bound and age; without a bound when it is not current."""
    level, word = Level.QUIET, " -"
    if other.verdict is not None and not view.is_silent:
        level, word = _STATUS_LEVELS[other.verdict.status], f" {other.verdict.status.value}"
        if is_current(other):
            bound = Number.MM.text(other.verdict.predicted_tre_mm).strip()
            word = f"{view.symbols.at_most:>2}{bound} mm"
        elif other.verdict.status is Status.OK:
            level, word = Level.QUIET, " old"
    name, said = f"{other.name:<7.7} ", f"{level.mark(view.symbols)}{word}"
    age = _age(None if view.is_silent else other.age_ms).rjust(width - len(name) - len(said))
    return Content.assemble((name, "$text-muted"), (said, level.value), (age, "$text-muted"))


def _age(age_ms: float | None) -> str:
    """Of at most six characters, in seconds from one second on."""
    if age_ms is None:
        return "-"
    return f"{age_ms:.0f} ms" if age_ms < 999.5 else f"{min(age_ms / 1e3, 9999.0):.0f} s"


def _title(snapshot: Snapshot) -> str:
    """Whose figures these are."""
    shown = [one.number for one in snapshot.candidates if one.is_shown]
    if not snapshot.is_candidate:
        return "pose"
    if len(snapshot.candidates) < 2 or not shown:
        return "candidate"
    return f"candidate {shown[0]}, {len(snapshot.candidates)} wait"


def _candidate(view: View, width: int) -> list[Content]:
    """The judge's word on the candidate and the figures to decide by."""
    snapshot, verdict = view.snapshot, view.snapshot.verdict
    status = Status.LOST if verdict is None else verdict.status
    level = _STATUS_LEVELS[status]
    lines = [Content.styled(f"{level.mark(view.symbols)} judged {status.value}", level.value)]
    figures = [_figure("seen", Number.WHOLE, _compute_seen_percent(snapshot), "%"), *_fit(snapshot)]
    accept = ("a", "bold $foreground"), " accept   "
    if is_too_slow(snapshot):
        slow = textwrap.wrap("too slow to draw it in time", width)
        lines += [Content.styled(line, Level.BAD.value) for line in slow]
    if not view.has_colours:
        told = textwrap.wrap("no outline in so few colours: judge it in --window", width)
        lines += [Content.styled(line, Level.BAD.value) for line in told]
    others = [Content("arrows: compare")] if len(snapshot.candidates) > 1 else []
    asks = [
        *others,
        Content.assemble(
            *(accept if not why_refused(Accept(snapshot.candidate_id), snapshot) else ()),
            ("r", "bold"),
            " reject",
        ),
    ]
    if verdict is not None and verdict.reasons:
        why = textwrap.wrap(verdict.reasons[0].value, width)[:2]
        lines += [Content.styled(line, level.value) for line in why]
        figures = figures[:2]
    return [*lines, *figures, *asks]


def _fit(snapshot: Snapshot) -> list[Content]:
    verdict = snapshot.verdict
    rms = None if verdict is None else verdict.rms_mm
    expected = None if verdict is None else verdict.expected_rms_mm
    return [
        _figure("rms", Number.MM, rms, "mm"),
        _figure("expected", Number.MM, expected, "mm"),
    ]


def _figure(name: str, number: Number, value: float | None, unit: str) -> Content:
    return Content.assemble(
        (f"{name:<10}", "$text-muted"), number.text(value).rjust(7), (f" {unit}", "$text-muted")
    )


def _compute_seen_percent(snapshot: Snapshot) -> float | None:
    return None if snapshot.verdict is None else 100.0 * snapshot.verdict.coverage


def _compute_occluded_percent(snapshot: Snapshot) -> float | None:
    return None if snapshot.verdict is None else 100.0 * snapshot.verdict.occluded_fraction


def _error(view: View, width: int) -> list[Content]:
    """The error's bound and its bar against the stage's tolerance."""
    snapshot = view.snapshot
    error = None
    if snapshot.verdict is not None and not view.is_silent:
        error = snapshot.verdict.predicted_tre_mm
    tolerance = snapshot.stage.tolerance_mm
    is_over = error is not None and error > tolerance
    style = Level.BAD.value if is_over else "bold $foreground"
    bar_style = Level.BAD.value if is_over else "$success"
    return [
        Content.assemble(
            ("error  ", "$text-muted"),
            (f"{view.symbols.at_most} {Number.MM.text(error)} mm", style),
            ("  over" if is_over else "", style),
        ),
        Content.assemble(
            (draw_bar(error, tolerance, max(width - 5, 4), view.symbols), bar_style),
            (f"{tolerance:5.2f}", "$text-muted"),
        ),
    ]
