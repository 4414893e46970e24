"""The tables of an evaluation in the layout of the paper's tables 1 to 3, as Markdown."""

from collections.abc import Sequence

from navapp.evaluation.frame_figures import pool_frames
from navapp.evaluation.judge.figures import JudgeFigures
from navapp.evaluation.methods import OURS
from navapp.evaluation.paper.cases import SAMPLES, SITUATIONS, STAGE_NAMES, Case
from navapp.evaluation.paper.published import CONTRADICTIONS, find_published
from navapp.evaluation.paper.rows import Row, find_ours
from navapp.evaluation.report_parts import (
    format_mm,
    format_number,
    format_share,
    format_table,
    make_quick_note,
)

_STAGES = {
    "opening": "opening the knee",
    "drilling": "drilling the bone",
    "implant": "position of the implant",
    "patella": "resurfacing the patella",
    "spacer": "insertion of the spacer",
}
_HEAD = (
    "stage", "situation", "state of the art, paper: mm, fps",
    "`icp` here: mm, TRE mm, fps, refused", "proposal, paper: mm, fps",
    "`paper` here: mm, TRE mm, fps, refused", "**`bimcc`: overlay mm (95 %)**", "TRE mm (95 %)",
    "OK", "within the bound", "fps", "registration s",
)  # fmt: skip
_ABOUT = (
    "Overlay error: mean displacement, in the rectified left picture, of the model's pixels "
    "between the true and the estimated pose, times depth over focal length. The paper's figures "
    "are its alignment error (state of the art) and overlay error (proposal), for which it gives "
    "no formula. TRE: mean over the stage's targets. Errors of `bimcc` are those of frames that "
    "its judge calls OK; `icp` and `paper`, carried on whatever our judge says (`refused` counts "
    "its refusals), are measured in every frame with a pose: where that is many millimetres, the "
    "method has lost the bone, and frames in which it is drawn beside the picture have no overlay "
    "error. Within the bound: share of OK frames whose TRE is below the predicted error. fps: one "
    "over the mean time of a frame, from a pass of its own, of the first knee of each case alone. "
    "Intervals: bootstrap over knees.\n"
)


def make_tables(
    rows: Sequence[Row],
    judged: Sequence[JudgeFigures],
    about: Sequence[str],
    sections: Sequence[str] = (),
    *,
    is_quick: bool,
) -> str:
    """The whole of `tables.md`.

    Args:
        rows: of all cases and methods.
        judged: of all methods.
        about: how it was made, a line each.
        sections: further ones, a line each.
        is_quick: it is a short look, and says so.
    """
    parts = ["# Evaluation on simulated knees", ""]
    if is_quick:
        parts += make_quick_note("one short test of each case, times taken while others ran")
    parts += [*(f"- {line}" for line in about), "", _ABOUT]
    by_case = {(row.case, row.method): row for row in rows}
    for number, (name, sample) in enumerate(SAMPLES.items(), start=1):
        cases = [Case(name, stage, situation) for stage in STAGE_NAMES for situation in SITUATIONS]
        shown = [case for case in cases if any(row.case == case for row in rows)]
        if shown:
            firsts = {case.stage: case for case in reversed(shown)}
            cells = (
                (
                    _STAGES[case.stage] if case is firsts[case.stage] else "",
                    *_format_case(case, by_case),
                )
                for case in shown
            )
            parts += [f"## Table {number}: {sample.title}", "", *format_table(_HEAD, cells), ""]
    parts += [*_format_stages(rows), *_format_judged(judged), *sections]
    parts += ["## Where the paper contradicts itself", "", *(f"- {one}" for one in CONTRADICTIONS)]
    return "\n".join(parts) + "\n"


def _format_case(case: Case, rows: dict[tuple[Case, str], Row]) -> tuple[str, ...]:
    told = find_published(case)
    return (
        SITUATIONS[case.situation].title,
        f"{told.icp_mm:.2f}, {told.icp_fps:.0f}",
        _format_other(rows.get((case, "icp"))),
        f"{told.paper_mm:.2f}, {told.paper_fps:.0f}",
        _format_other(rows.get((case, "paper"))),
        *_format_ours(rows.get((case, OURS))),
    )


def _format_other(row: Row | None) -> str:
    if row is None:
        return "-"
    errors = f"{format_mm(row.overlay_mm)}, {format_mm(row.tre_mm)}"
    return f"{errors}, {format_number(row.fps)}, {format_share(1.0 - row.figures.ok_share)}"


def _format_ours(row: Row | None) -> tuple[str, ...]:
    if row is None:
        return ("-",) * 6
    return (
        f"**{format_mm(row.overlay_mm)}**{_interval(row.overlay_ci95)}",
        f"{format_mm(row.tre_mm)}{_interval(row.tre_ci95)}",
        format_share(row.figures.ok_share),
        format_share(row.figures.bound_coverage),
        format_number(row.fps),
        format_number(row.registration_s, 1),
    )


def _format_stages(rows: Sequence[Row]) -> list[str]:
    """Ours by stage and situation, all samples together."""
    head = (
        "stage", "situation", "knees", "frames", "OK", "TRE mm", "worst mm", "overlay mm",
        "within the bound",
    )  # fmt: skip
    cells = [
        (_STAGES[stage], told.title, *_format_pooled(found))
        for stage in STAGE_NAMES
        for situation, told in SITUATIONS.items()
        if (found := find_ours(rows, stage, situation))
    ]
    return [
        "## `bimcc` by stage and situation",
        "",
        "All samples together. Errors are those of OK frames: mean, and the worst one.",
        "",
        *format_table(head, cells),
        "",
    ]


def _format_pooled(rows: Sequence[Row]) -> tuple[str, ...]:
    """Cells of several cases together."""
    figures = pool_frames(row.figures.frames for row in rows)
    return (
        str(sum(len(row.seeds) for row in rows)),
        str(figures.n_frames),
        format_share(figures.ok_share),
        format_mm(figures.ok.mean_mm),
        format_mm(figures.ok.worst_mm),
        format_mm(figures.ok.mean_displacement_mm),
        format_share(figures.bound_coverage),
    )


def _format_judged(judged: Sequence[JudgeFigures]) -> list[str]:
    head = (
        "method", "frames", "OK", "knees", "OK and wrong", "upper limit (95 %), of OK frames",
        "upper limit (95 %), of knees", "within the bound",
    )  # fmt: skip
    return [
        "## The judge",
        "",
        "OK and wrong: more than 1 mm off, and more than the predicted bound. Frames of one knee "
        "are alike: the limit by knees is the one to be believed.",
        "",
        *format_table(head, (_format_one_judged(one) for one in judged)),
        "",
    ]


def _format_one_judged(one: JudgeFigures) -> tuple[str, ...]:
    figures, (by_frames, by_knees) = one.figures, one.find_upper_limits()
    return (
        f"`{one.method}`", str(figures.n_frames), str(figures.n_ok), str(one.n_knees),
        str(figures.n_wrong), f"{100.0 * by_frames:.3f} %", f"{100.0 * by_knees:.1f} %",
        format_share(figures.bound_coverage),
    )  # fmt: skip


def _interval(ends: tuple[float, float] | None) -> str:
    return "" if ends is None else f" ({ends[0]:.3f} to {ends[1]:.3f})"
