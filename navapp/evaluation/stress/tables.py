"""The tables of the stress matrix as Markdown."""

from collections.abc import Sequence

from navapp.evaluation.paper.summary import Judged
from navapp.evaluation.stress.bars import check_blur
from navapp.evaluation.stress.rows import ENDED_SHARE, KEPT_SHARE, AxisRows, LevelRow

_ABOUT = (
    "One thing at a time is made worse; all else is as usual: stage opening, the leg breathes. "
    "TRE: mean over the stage's targets, against where they really are. Median and worst are of "
    "frames that the judge calls OK; *any* is the median of all frames with a pose. OK and wrong: "
    "OK, more than 1 mm off and more than the predicted bound. Within: share of OK frames within "
    "their bound. Where the leg is moved, only frames at nine tenths of its speed or more count.\n"
)
_CAUSES = (
    "Pictures cannot show these: the pose is wrong and everything agrees. OK and wrong frames are "
    'expected here at levels marked *hidden*; they are not counted under "OK and wrong".\n'
)
_HEAD = (
    "| {} | OK | TRE median, mm | worst OK, mm | any, mm | OK and wrong | within "
    "| most frequent reason of the others |"
)


def make_stress_tables(
    axes: Sequence[AxisRows], judged: Judged, about: Sequence[str], *, is_quick: bool
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
        parts += ["**A quick look: one knee and 3 frames a level. These are no results.**", ""]
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
    lines = [
        "| cause | median TRE of any pose, mm, at its level | 1 mm is passed at "
        f"| OK in fewer than {ENDED_SHARE:.0%} from | what finds it |",
        "|---|---|---|---|---|",
    ]
    for one in causes:
        errors = "; ".join(f"{_mm(row.tre_any_mm)} at {row.level:g}" for row in one.rows)
        passed, ends = (_join(levels, one) for levels in (one.find_passed(), one.find_ends()))
        title = ", ".join(part for part in (one.axis.title, one.axis.unit) if part)
        lines.append(f"| {title} | {errors} | {passed} | {ends} | {one.axis.found_by} |")
    return lines


def _format_ends(others: Sequence[AxisRows]) -> list[str]:
    lines = [
        f"| axis | usual | OK in {KEPT_SHARE:.0%} of frames up to | in fewer than "
        f"{ENDED_SHARE:.0%} from | reason there | OK and wrong |",
        "|---|---|---|---|---|---|",
    ]
    for one in others:
        ends = one.find_ends()
        reasons = [row.reason for row in one.rows if row.level in ends and row.reason]
        lines.append(
            f"| {one.axis.title} | {_with_unit(one.axis.usual, one)} | "
            f"{_join(one.find_kept(), one)} | {_join(ends, one)} | "
            f"{'; '.join(dict.fromkeys(reasons)) or '-'} | {one.n_wrong} |"
        )
    return lines


def _format_wrong(axes: Sequence[AxisRows], judged: Judged) -> list[str]:
    by_frames, by_knees = judged.wrong_at_most
    lines = [
        f"Over all levels that pictures can show: {judged.n_wrong} of {judged.n_ok} OK frames, of "
        f"{judged.n_frames}, are wrong; in {judged.n_wrong_knees} of {judged.n_knees} knees. "
        f"At most {100.0 * by_frames:.3f} % of OK frames and {100.0 * by_knees:.1f} % of knees "
        "(95 %, one-sided; frames of one knee are alike)."
    ]
    for one in axes:
        levels = [row.level for row in one.rows if row.n_wrong and not row.is_hidden]
        if levels:
            lines += ["", f"- {one.axis.title}: {one.n_wrong}, at {_join(levels, one)}; "
                          f"found by {one.axis.found_by}"]  # fmt: skip
    return lines


def _format_blur(axes: Sequence[AxisRows]) -> list[str]:
    held = check_blur(axes)
    if not held:
        return []
    lines = [
        "## Motion blur, rolling shutter, shake",
        "",
        "| | OK | TRE median, mm | worst OK, mm | within | misses |",
        "|---|---|---|---|---|---|",
    ]
    for one in held:
        row = one.row
        lines.append(
            f"| {one.title} | {row.ok_share:.0%} | {_mm(row.tre_mm)} | {_mm(row.worst_mm)} | "
            f"{_share(row.coverage)} | {', '.join(one.missed) or 'nothing'} |"
        )
    return [*lines, ""]


def _format_axis(one: AxisRows) -> list[str]:
    unit = f"level, {one.axis.unit}" if one.axis.unit else "level"
    lines = [f"### {one.axis.title}", "", _HEAD.format(unit), "|---" * 8 + "|"]
    return [*lines, *(_format_level(row, one.axis.usual) for row in one.rows), ""]


def _format_level(row: LevelRow, usual: float) -> str:
    told = f"{row.reason} ({row.reason_share:.0%})" if row.reason else "-"
    mark = " (usual)" if row.level == usual else " (hidden)" if row.is_hidden else ""
    return (
        f"| {row.level:g}{mark} | {row.ok_share:.0%} | {_mm(row.tre_mm)} | {_mm(row.worst_mm)} | "
        f"{_mm(row.tre_any_mm)} | {row.n_wrong} | {_share(row.coverage)} | {told} |"
    )


def _join(levels: Sequence[float | None], one: AxisRows) -> str:
    """Levels of the sides; not reached on any: a dash."""
    known = [_with_unit(level, one) for level in levels if level is not None]
    return " and ".join(known) or "-"


def _with_unit(level: float, one: AxisRows) -> str:
    # Three digits, and no exponent.
    return f"{float(f'{level:.3g}'):g} {one.axis.unit}".strip()


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.0%}"
