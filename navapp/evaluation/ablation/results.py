"""Writes what an ablation has found: tables, report, JSON and every frame as CSV."""

import csv
import io
import os
import platform
from collections.abc import Sequence
from typing import Any

from calibration.report.page import make_html
from calibration.report.plots import BLUE, ORANGE, draw_svg
from navapp import __version__
from navapp.evaluation.ablation.rows import ALL, VariantRow, make_variant_rows
from navapp.evaluation.ablation.settings import AblationSettings
from navapp.evaluation.ablation.tables import make_ablation_tables
from navapp.evaluation.campaign import CampaignFolder, Done
from navapp.evaluation.paper.cases import SITUATIONS, SWEEP_FRAMES, CaseTest
from navapp.evaluation.paper.report import render_markdown
from navapp.geometry.whole_files import write_whole

_COLUMNS = (
    "index", "status", "tre_mm", "displacement_mm", "outline_mm", "bound_mm", "seen", "hidden",
    "total_ms", "is_search",
)  # fmt: skip


def write_ablation(folder: CampaignFolder[CaseTest], settings: AblationSettings) -> dict[str, Any]:
    """Write `ablation.md`, `report.html` and `frames.csv` of what is done; rows for programs."""
    done = list(folder.read(is_timed=False))
    is_quick = settings.knees.is_quick
    rows = make_variant_rows(done, done if is_quick else list(folder.read(is_timed=True)))
    tables = make_ablation_tables(rows, _about(settings, done), is_quick=is_quick)
    write_whole(folder.path / "ablation.md", tables.encode())
    of_all = [row for row in rows if row.stage == ALL]
    charts = ["<h2>All stages and situations</h2>", draw_variants(of_all)] if of_all else []
    report = make_html("Ablation", [render_markdown(tables), *charts])
    write_whole(folder.path / "report.html", report.encode())
    write_whole(folder.path / "frames.csv", _make_csv(done).encode())
    return {
        "rows": [row.to_json() for row in rows if row.stage != ALL],
        "summary": {
            "tests": len(done),
            "of": len(settings.tests),
            "quick": is_quick,
            "variants": [row.to_json() for row in of_all],
        },
    }


def _about(settings: AblationSettings, done: Sequence[Done[CaseTest]]) -> list[str]:
    knees = settings.knees
    samples = list(dict.fromkeys(case.sample for case in knees.cases))
    has_sweep = any(SITUATIONS[case.situation].instrument != "none" for case in knees.cases)
    with_sweep = f" ({max(knees.n_frames, SWEEP_FRAMES)} with an instrument)"
    return [
        f"navapp {__version__}, Python {platform.python_version()}, {platform.machine()}, "
        f"{os.cpu_count()} cores",
        f"{len(done)} of {len(settings.tests)} tests, each another knee, of sample "
        f"{', '.join(samples)}; {knees.n_frames} frames each after the registration"
        f"{with_sweep if has_sweep and not knees.is_quick else ''}; first seed {knees.first_seed}",
        "simulated devices; research software, not for clinical use",
    ]


def draw_variants(rows: Sequence[VariantRow]) -> str:
    """Errors, shares of frames and times of all variants, SVG."""
    places = range(len(rows))

    def draw(figure: Any) -> None:
        errors, shares, times = figure.subplots(1, 3, sharey=True)
        for label, values, marker, colour in (
            ("OK, mean", [row.tre_ok_mm for row in rows], "o", BLUE),
            ("OK, worst", [row.worst_ok_mm for row in rows], "x", BLUE),
            ("all, mean", [row.tre_any_mm for row in rows], "s", ORANGE),
        ):
            known = [(v, k) for k, v in enumerate(values) if v is not None]
            if known:
                errors.plot(*zip(*known, strict=True), marker, color=colour, ms=5, label=label)
        # Without the judge errors are a thousand times as large.
        errors.set(xlabel="TRE, mm", xscale="log")
        errors.grid(axis="x", alpha=0.3)
        for shift, label, counts, colour in (
            (-0.2, "OK", [row.n_ok for row in rows], BLUE),
            (0.2, "OK and wrong", [row.n_wrong for row in rows], ORANGE),
        ):
            widths = [n / max(row.n_frames, 1) for n, row in zip(counts, rows, strict=True)]
            shares.barh([k + shift for k in places], widths, 0.36, color=colour, label=label)
        shares.set(xlabel="share of frames", xlim=(0.0, 1.0))
        times.barh(places, [row.median_ms or 0.0 for row in rows], 0.6, color=BLUE)
        times.set(xlabel="median time of a frame, ms")
        errors.set_yticks(places, [row.variant for row in rows], fontsize=8)
        errors.invert_yaxis()
        for axes in (errors, shares):
            axes.legend(frameon=False, fontsize=7, loc="upper center", bbox_to_anchor=(0.5, 1.2),
                        ncols=3)  # fmt: skip

    return draw_svg(draw, (9.6, 3.4))


def _make_csv(done: Sequence[Done[CaseTest]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(
        ("sample", "stage", "situation", "test", "seed", "variant", *_COLUMNS, "reasons")
    )
    for one in done:
        test, case = one.test, one.test.case
        for variant, followed in one.followed.items():
            for frame in followed.frames:
                values = (getattr(frame, name) for name in _COLUMNS)
                writer.writerow(
                    (case.sample, case.stage, case.situation, test.number, test.seed, variant,
                     *values, "; ".join(frame.reasons))
                )  # fmt: skip
    return out.getvalue()
