"""The tables of the stress matrix as Markdown."""

from collections.abc import Sequence

from navapp.evaluation.judge.figures import JudgeFigures
from navapp.evaluation.report_parts import (
    format_number,
    format_share,
    format_table,
    make_quick_note,
)
from navapp.evaluation.stress.bars import check_blur
from navapp.evaluation.stress.rows import ENDED_SHARE, KEPT_SHARE, AxisRows, LevelRow

_ABOUT = (
    "One thing at a time is made worse; all else is as usual: stage opening, the leg breathes. "
    "TRE: mean over the stage's targets, against where they really are. Median and worst are of "
    "frames that the judge calls OK; *any* is the median of all frames with a pose. OK and wrong: "
    "OK, more than 1 mm off and more than the predicted bound. Within: share of OK frames within "
    "their bound. Where the leg is moved to and fro, shares and medians are of frames at nine "
    "tenths of its speed or more; the worst one, and OK and wrong, are of all.\n"
)
_CAUSES = (
    "Pictures cannot show these: the pose is wrong and everything agrees. OK and wrong frames are "
    'expected here at levels marked *hidden*; they are not counted under "OK and wrong".\n'
)
_HEAD = (
    "OK", "TRE median, mm", "worst OK, mm", "any, mm", "OK and wrong", "within",
    "most frequent reason of the others",
)  # fmt: skip


def make_stress_tables(
    axes: Sequence[AxisRows], judged: JudgeFigures, about: Sequence[str], *, is_quick: bool
) -> str:
    """The whole of `stress.md`.

    Args:
        axes: of all that were run.
        judged: over all levels that pictures can show.
        about: how it was made, a line each.
        is_quick: it is a short look, and says so.
    """
    parts = ["# Stress matrix on simulated knees", ""]
    if is_quick:
        parts += make_quick_note("one knee and 3 frames a level")
    parts += [*(f"- {line}" for line in about), "", _ABOUT]
    causes = [one for one in axes if one.axis.is_cause]
    others = [one for one in axes if not one.axis.is_cause]
    if causes:
        parts += ["## What it cannot notice", "", _CAUSES, *_format_causes(causes), ""]
        parts += [line for one in causes for line in _format_axis(one)]
    parts += ["## Where OK ends", "", *_format_ends(others), ""]
    parts += ["## OK and wrong", "", *_format_wrong(axes, judged), ""]
    parts += _format_blur(axes)
    parts += [line for one in others for line in _format_axis(one)]
    return "\n".join(parts) + "\n"


def _format_causes(causes: Sequence[AxisRows]) -> list[str]:
    head = (
        "cause", "median TRE of any pose, mm, at its level", "1 mm is passed at",
        f"OK in fewer than {ENDED_SHARE:.0%} from", "what finds it",
    )  # fmt: skip
    return format_table(head, (_format_cause(one) for one in causes))


def _format_cause(one: AxisRows) -> tuple[str, ...]:
    errors = "; ".join(f"{_mm(row.tre_any_mm)} at {row.level:g}" for row in one.rows)
    passed, ends = (_join(levels, one) for levels in (one.find_passed(), one.find_ends()))
    title = ", ".join(part for part in (one.axis.title, one.axis.unit) if part)
    return title, errors, passed, ends, one.axis.found_by


def _format_ends(others: Sequence[AxisRows]) -> list[str]:
    head = (
        "axis", "usual", f"OK in {KEPT_SHARE:.0%} of frames up to",
        f"in fewer than {ENDED_SHARE:.0%} from", "reason there", "OK and wrong",
    )  # fmt: skip
    return format_table(head, (_format_end(one) for one in others))


def _format_end(one: AxisRows) -> tuple[str, ...]:
    ends = one.find_ends()
    reasons = [row.reason for row in one.rows if row.level in ends and row.reason]
    return (
        one.axis.title, _with_unit(one.axis.usual, one), _join(one.find_kept(), one),
        _join(ends, one), "; ".join(dict.fromkeys(reasons)) or "-", str(one.n_wrong),
    )  # fmt: skip


def _format_wrong(axes: Sequence[AxisRows], judged: JudgeFigures) -> list[str]:
    figures, (by_frames, by_knees) = judged.figures, judged.find_upper_limits()
    lines = [
        f"Over all levels that pictures can show: {figures.n_wrong} of {figures.n_ok} OK frames, "
        f"of {figures.n_frames}, are wrong; in {judged.n_wrong_knees} of {judged.n_knees} knees. "
        f"At most {100.0 * by_frames:.3f} % of OK frames and {100.0 * by_knees:.1f} % of knees "
        "(95 %, one-sided; frames of one knee are alike).",
        "",
    ]
    for one in axes:
        levels = [row.level for row in one.rows if row.every.n_wrong and not row.is_hidden]
        if levels:
            lines.append(
                f"- {one.axis.title}: {one.n_wrong}, at {_join(levels, one)}; "
                f"found by {one.axis.found_by}"
            )
    hidden = {one.axis.name: one.n_wrong_hidden for one in axes if one.n_wrong_hidden}
    told = ", ".join(f"{name} {n}" for name, n in hidden.items()) or "none"
    return [*lines, f"- at levels that pictures cannot show, not counted above: {told}"]


def _format_blur(axes: Sequence[AxisRows]) -> list[str]:
    held = check_blur(axes)
    if not held:
        return []
    head = "", "OK", "TRE median, mm", "worst OK, mm", "within", "misses"
    cells = (
        (one.title, *_format_errors(one.row), ", ".join(one.missed) or "nothing") for one in held
    )
    return ["## Motion blur, rolling shutter, shake", "", *format_table(head, cells), ""]


def _format_errors(row: LevelRow) -> tuple[str, ...]:
    return (
        format_share(row.ok_share), _mm(row.tre_mm), _mm(row.worst_mm),
        format_share(row.figures.bound_coverage),
    )  # fmt: skip


def _format_axis(one: AxisRows) -> list[str]:
    unit = f"level, {one.axis.unit}" if one.axis.unit else "level"
    cells = (_format_level(row, one.axis.usual) for row in one.rows)
    return [f"### {one.axis.title}", "", *format_table((unit, *_HEAD), cells), ""]


def _format_level(row: LevelRow, usual: float) -> tuple[str, ...]:
    told = f"{row.reason} ({format_share(row.reason_share)})" if row.reason else "-"
    mark = " (usual)" if row.level == usual else " (hidden)" if row.is_hidden else ""
    ok_share, tre_mm, worst_mm, within = _format_errors(row)
    return (
        f"{row.level:g}{mark}", ok_share, tre_mm, worst_mm, _mm(row.tre_any_mm),
        str(row.every.n_wrong), within, told,
    )  # fmt: skip


def _join(levels: Sequence[float | None], one: AxisRows) -> str:
    """Levels of the sides; not reached on any: a dash."""
    known = [_with_unit(level, one) for level in levels if level is not None]
    return " and ".join(known) or "-"


def _with_unit(level: float, one: AxisRows) -> str:
    # Three digits, and no exponent.
    return f"{float(f'{level:.3g}'):g} {one.axis.unit}".strip()


def _mm(value: float | None) -> str:
    return format_number(value, 2)
