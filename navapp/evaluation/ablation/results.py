"""Writes what an ablation has found: tables, report, JSON and every frame as CSV."""

import csv
import io
from collections.abc import Sequence
from typing import Any

from calibration.report.page import make_html
from navapp.evaluation.ablation.chart import draw_variants
from navapp.evaluation.ablation.rows import ALL, make_variant_rows
from navapp.evaluation.ablation.settings import AblationSettings
from navapp.evaluation.ablation.tables import make_ablation_tables
from navapp.evaluation.campaign import CampaignFolder, Done
from navapp.evaluation.paper.cases import CaseTest
from navapp.evaluation.paper.report import render_markdown
from navapp.evaluation.provenance import describe_origin
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
    samples = ", ".join(dict.fromkeys(case.sample for case in knees.cases))
    n_most = max(settings.count_frames(test) for test in settings.tests)
    of_instrument = f" ({n_most} with an instrument)" if n_most > knees.n_frames else ""
    return [
        describe_origin(),
        f"{len(done)} of {len(settings.tests)} tests, each another knee, of sample {samples}; "
        f"{knees.n_frames} frames each after the registration{of_instrument}; first seed "
        f"{knees.first_seed}",
        "simulated devices; research software, not for clinical use",
    ]


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
