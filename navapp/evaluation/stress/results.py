"""Writes what the stress matrix has found: tables, report, JSON and every frame as CSV."""

from collections.abc import Iterator, Sequence
from typing import Any

from calibration.report.page import make_html
from calibration.report.plots import BLUE, ORANGE, draw_svg
from navapp.evaluation.campaign import CampaignFolder, Done
from navapp.evaluation.judge.figures import JudgeFigures, judge_method
from navapp.evaluation.methods import OURS
from navapp.evaluation.provenance import describe_origin
from navapp.evaluation.report_parts import SIMULATED_NOTE, make_frames_csv, render_markdown
from navapp.evaluation.scores import FrameScore
from navapp.evaluation.stress.axes import AXES
from navapp.evaluation.stress.bars import check_blur
from navapp.evaluation.stress.matrix import StressSettings, StressTest
from navapp.evaluation.stress.rows import AxisRows, make_axis_rows
from navapp.evaluation.stress.tables import make_stress_tables
from navapp.geometry.whole_files import write_whole

# What is further off would hide all else.
_MOST_MM = 3.0


def write_stress(folder: CampaignFolder[StressTest], settings: StressSettings) -> dict[str, Any]:
    """Write `stress.md`, `report.html` and `frames.csv` of what is done; the rows for programs."""
    done = list(folder.read(is_timed=False))
    axes = [make_axis_rows(AXES[name], done) for name in settings.axes]
    axes = [one for one in axes if one.rows]
    judged = _judge(done)
    tables = make_stress_tables(
        axes, judged, _describe_run(settings, done), is_quick=settings.is_quick
    )
    write_whole(folder.path / "stress.md", tables.encode())
    charts = [_draw(one) for one in axes]
    report = make_html("Stress matrix", [render_markdown(tables), "<h2>Charts</h2>", *charts])
    write_whole(folder.path / "report.html", report.encode())
    write_whole(folder.path / "frames.csv", _make_csv(done).encode())
    return {
        "origin": describe_origin(),
        "axes": [one.to_json() for one in axes],
        "summary": {
            "tests": len(done),
            "of": len(settings.tests),
            "quick": settings.is_quick,
            "judged": judged.to_json(),
            "wrong_and_ok_on": [one.axis.name for one in axes if one.n_wrong],
            "blur": [{"title": one.title, "misses": list(one.missed)} for one in check_blur(axes)],
        },
    }


def _judge(done: Sequence[Done[StressTest]]) -> JudgeFigures:
    """All frames that were followed, at levels that pictures can show."""
    return judge_method(
        OURS,
        (
            (one.test.seed, one.scores[OURS].frames)
            for one in done
            if not one.test.axis.is_hidden(one.test.level)
        ),
    )


def _describe_run(settings: StressSettings, done: Sequence[Done[StressTest]]) -> list[str]:
    return [
        describe_origin(),
        f"{len(done)} of {len(settings.tests)} sequences: {settings.n_knees} knees a level, the "
        f"same at all levels of an axis, {settings.n_frames} frames each that count; first seed "
        f"{settings.first_seed}",
        SIMULATED_NOTE,
    ]


def _draw(one: AxisRows) -> str:
    """Error and share of OK frames over the level, SVG."""
    rows, axis = one.rows, one.axis
    places = range(len(rows))

    def draw(figure: Any) -> None:
        errors, shares = figure.subplots(1, 2)
        for label, values, colour in (
            ("any pose, median", [row.tre_any_mm for row in rows], ORANGE),
            ("OK, median", [row.tre_mm for row in rows], BLUE),
        ):
            known = [
                (k, min(v, _MOST_MM)) for k, v in zip(places, values, strict=True) if v is not None
            ]
            if known:
                errors.plot(*zip(*known, strict=True), "o-", color=colour, label=label, ms=3)
        worst = [
            (k, min(row.worst_mm, _MOST_MM))
            for k, row in enumerate(rows)
            if row.worst_mm is not None
        ]
        if worst:
            errors.plot(*zip(*worst, strict=True), "x", color=BLUE, label="OK, worst", ms=4)
        errors.set(ylabel=f"TRE, mm (cut at {_MOST_MM:g})", ylim=(0.0, None))
        errors.legend(frameon=False, fontsize=7)
        shares.bar(places, [row.ok_share for row in rows], color=BLUE)
        shares.set(ylabel="share of OK frames", ylim=(0.0, 1.0))
        for axes in (errors, shares):
            axes.set_xticks(places, [f"{row.level:g}" for row in rows], fontsize=7)
            axes.set_xlabel(f"{axis.name}, {axis.unit}" if axis.unit else axis.name)
        figure.suptitle(axis.title, fontsize=9)

    return draw_svg(draw, (9.6, 2.6))


def _make_csv(done: Sequence[Done[StressTest]]) -> str:
    def list_frames() -> Iterator[tuple[Sequence[object], FrameScore]]:
        for one in done:
            test = one.test
            for frame in one.scores[OURS].frames:
                counts = test.counts(frame.index)
                keys = test.axis_name, f"{test.level:g}", test.knee, test.seed, counts
                yield keys, frame

    return make_frames_csv(("axis", "level", "knee", "seed", "counts"), list_frames())
