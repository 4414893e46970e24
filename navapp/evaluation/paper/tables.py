"""The tables of an evaluation in the layout of the paper's tables 1 to 3, as Markdown."""

from collections.abc import Callable, Sequence

from navapp.evaluation.paper.cases import SAMPLES, SITUATIONS, STAGE_NAMES, Case
from navapp.evaluation.paper.published import CONTRADICTIONS, find_published
from navapp.evaluation.paper.rows import Row, find_ours
from navapp.evaluation.paper.summary import Judged
from navapp.tracking import Method

_STAGES = {
    "opening": "opening the knee",
    "drilling": "drilling the bone",
    "implant": "position of the implant",
    "patella": "resurfacing the patella",
    "spacer": "insertion of the spacer",
}
_HEAD = (
    "| stage | situation | state of the art, paper: mm, fps | `icp` here: mm, TRE mm, fps, refused "
    "| proposal, paper: mm, fps | `paper` here: mm, TRE mm, fps, refused "
    "| **`bimcc`: overlay mm (95 %)** | TRE mm (95 %) | OK | within the bound | fps "
    "| registration s |"
)
_ABOUT = (
    "Overlay error: mean displacement, in the rectified left picture, of the model's pixels "
    "between the true and the estimated pose, times depth over focal length. The paper's figures "
    "are its alignment error (state of the art) and overlay error (proposal), for which it gives "
    "no formula. TRE: mean over the stage's targets. Errors of `bimcc` are those of frames that "
    "its judge calls OK; `icp` and `paper`, carried on whatever our judge says (`refused` counts "
    "its refusals), are measured in every frame with a pose: where that is many millimetres, the "
    "method has lost the bone, and frames in which it is drawn beside the picture have no overlay "
    "error. Within the bound: share of OK frames whose TRE is below the predicted error. fps: one "
    "over the mean time of a frame, from a pass of its own. "
    "Intervals: bootstrap over knees.\n"
)


def make_tables(
    rows: Sequence[Row],
    judged: Sequence[Judged],
    about: Sequence[str],
    of_the_judge: Sequence[str] = (),
    *,
    is_quick: bool,
) -> str:
    """The whole of `tables.md`.

    Args:
        rows: of all cases and methods.
        judged: of all methods.
        about: how it was made, a line each.
        of_the_judge: further lines on it.
        is_quick: it is a short look, and says so.
    """
    parts = ["# Evaluation on simulated knees", ""]
    if is_quick:
        parts += [
            "**A quick look: one short test of each case, times taken while others ran. These are "
            "no results.**",
            "",
        ]
    parts += [*(f"- {line}" for line in about), "", _ABOUT]
    by_case = {(row.case, row.method): row for row in rows}
    for number, (name, sample) in enumerate(SAMPLES.items(), start=1):
        cases = [Case(name, stage, situation) for stage in STAGE_NAMES for situation in SITUATIONS]
        shown = [case for case in cases if any(row.case == case for row in rows)]
        if shown:
            parts += [f"## Table {number}: {sample.title}", "", _HEAD, "|---" * 12 + "|"]
            parts += [_format_case(case, by_case) for case in shown] + [""]
    parts += [*_format_stages(rows), *_format_judged(judged), *of_the_judge]
    parts += ["## Where the paper contradicts itself", "", *(f"- {one}" for one in CONTRADICTIONS)]
    return "\n".join(parts) + "\n"


def _format_case(case: Case, rows: dict[tuple[Case, Method], Row]) -> str:
    told = find_published(case)
    cells = [
        _STAGES[case.stage] if case.situation == "registration" else "",
        SITUATIONS[case.situation].title,
        f"{told.icp_mm:.2f}, {told.icp_fps:.0f}",
        _format_other(rows.get((case, "icp"))),
        f"{told.paper_mm:.2f}, {told.paper_fps:.0f}",
        _format_other(rows.get((case, "paper"))),
        *_format_ours(rows.get((case, "bimcc"))),
    ]
    return "| " + " | ".join(cells) + " |"


def _format_other(row: Row | None) -> str:
    if row is None:
        return "-"
    errors = f"{format_mm(row.overlay_mm)}, {format_mm(row.tre_mm)}"
    return f"{errors}, {_fps(row.fps)}, {_percent(1.0 - row.ok_share)}"


def _format_ours(row: Row | None) -> tuple[str, ...]:
    if row is None:
        return ("-",) * 6
    seconds = "-" if row.registration_s is None else f"{row.registration_s:.1f}"
    return (
        f"**{format_mm(row.overlay_mm)}**{_interval(row.overlay_ci95)}",
        f"{format_mm(row.tre_mm)}{_interval(row.tre_ci95)}",
        _percent(row.ok_share),
        "-" if row.coverage is None else _percent(row.coverage),
        _fps(row.fps),
        seconds,
    )


def _format_stages(rows: Sequence[Row]) -> list[str]:
    """Ours by stage and situation, all samples together."""
    lines = [
        "## `bimcc` by stage and situation",
        "",
        "All samples together. Errors are those of OK frames: mean, and the worst one.",
        "",
        "| stage | situation | knees | frames | OK | TRE mm | worst mm | overlay mm "
        "| within the bound |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for stage in STAGE_NAMES:
        for situation, told in SITUATIONS.items():
            if found := find_ours(rows, stage, situation):
                lines.append(f"| {_STAGES[stage]} | {told.title} | {_format_pooled(found)} |")
    return [*lines, ""]


def _format_pooled(rows: Sequence[Row]) -> str:
    """Cells of several cases together."""
    n_frames, n_ok = sum(row.n_frames for row in rows), sum(row.n_ok for row in rows)
    within = _pool(rows, lambda row: row.coverage)
    cells = (
        str(sum(len(row.seeds) for row in rows)),
        str(n_frames),
        _percent(n_ok / max(n_frames, 1)),
        format_mm(_pool(rows, lambda row: row.tre_mm)),
        format_mm(max((row.tre_worst_mm for row in rows if row.tre_worst_mm), default=None)),
        format_mm(_pool(rows, lambda row: row.overlay_mm)),
        "-" if within is None else _percent(within),
    )
    return " | ".join(cells)


def _pool(rows: Sequence[Row], value_of: Callable[[Row], float | None]) -> float | None:
    """Mean over all OK frames of several cases; None without any."""
    known = [(row.n_ok, value) for row in rows if (value := value_of(row)) is not None]
    n_ok = sum(n for n, _ in known)
    return sum(n * value for n, value in known) / n_ok if n_ok else None


def _format_judged(judged: Sequence[Judged]) -> list[str]:
    lines = [
        "## The judge",
        "",
        "OK and wrong: more than 1 mm off, and more than the predicted bound. Frames of one knee "
        "are alike: the limit by knees is the one to be believed.",
        "",
        "| method | frames | OK | knees | OK and wrong | at most, of OK frames | at most, of knees "
        "| within the bound |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in judged:
        by_frames, by_knees = one.wrong_at_most
        covered = "-" if one.coverage is None else _percent(one.coverage)
        lines.append(
            f"| `{one.method}` | {one.n_frames} | {one.n_ok} | {one.n_knees} | {one.n_wrong} | "
            f"{100.0 * by_frames:.3f} % | {100.0 * by_knees:.1f} % | {covered} |"
        )
    return [*lines, ""]


def format_mm(value: float | None) -> str:
    """A length for a table."""
    if value is None:
        return "-"
    return f"{value:.3f}" if value < 10.0 else f"{value:.0f}"


def _interval(ends: tuple[float, float] | None) -> str:
    return "" if ends is None else f" ({ends[0]:.3f} to {ends[1]:.3f})"


def _fps(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"


def _percent(share: float) -> str:
    """Whole; only all is 100 %, and only nothing 0 %."""
    if 0.0 < share < 0.01:
        return "< 1 %"
    return "> 99 %" if 0.99 < share < 1.0 else f"{100.0 * share:.0f} %"
