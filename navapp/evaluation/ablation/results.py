"""Writes what an ablation has found: tables, report, JSON and every frame as CSV."""

from collections.abc import Sequence
from typing import Any

from calibration.report.page import make_html
from navapp.evaluation.ablation.chart import draw_variants
from navapp.evaluation.ablation.rows import ALL, make_variant_rows
from navapp.evaluation.ablation.tables import make_ablation_tables
from navapp.evaluation.campaign import CampaignFolder, Done
from navapp.evaluation.paper.cases import SWEEP_FRAMES, CaseTest
from navapp.evaluation.paper.results import make_case_csv
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.provenance import describe_origin
from navapp.evaluation.report_parts import SIMULATED_NOTE, render_markdown
from navapp.geometry.whole_files import write_whole


def write_ablation(folder: CampaignFolder[CaseTest], settings: TableSettings) -> dict[str, Any]:
    """Write `ablation.md`, `report.html` and `frames.csv` of what is done; rows for programs."""
    done = list(folder.read(is_timed=False))
    is_quick = settings.is_quick
    rows = make_variant_rows(done, done if is_quick else list(folder.read(is_timed=True)))
    tables = make_ablation_tables(rows, _describe_run(settings, done), is_quick=is_quick)
    write_whole(folder.path / "ablation.md", tables.encode())
    of_all = [row for row in rows if row.stage == ALL]
    charts = ["<h2>All stages and situations</h2>", draw_variants(of_all)] if of_all else []
    report = make_html("Ablation", [render_markdown(tables), *charts])
    write_whole(folder.path / "report.html", report.encode())
    write_whole(folder.path / "frames.csv", make_case_csv(done, "variant").encode())
    return {
        "origin": describe_origin(),
        "rows": [row.to_json() for row in rows if row.stage != ALL],
        "summary": {
            "tests": len(done),
            "of": len(settings.tests),
            "quick": is_quick,
            "variants": [row.to_json() for row in of_all],
        },
    }


def _describe_run(settings: TableSettings, done: Sequence[Done[CaseTest]]) -> list[str]:
    samples = ", ".join(dict.fromkeys(case.sample for case in settings.cases))
    return [
        describe_origin(),
        f"{len(done)} of {len(settings.tests)} tests, each another knee, of sample {samples}; "
        f"{settings.n_frames} frames each after the registration (with an instrument at least "
        f"{SWEEP_FRAMES}, but in a quick look); first seed {settings.first_seed}",
        SIMULATED_NOTE,
    ]
