"""The report of an evaluation: one HTML file with tables, charts and a picture of each case."""

from collections.abc import Mapping, Sequence

from calibration.report.page import make_html, make_note
from navapp.evaluation.methods import OURS
from navapp.evaluation.paper.cases import Case
from navapp.evaluation.paper.charts import draw_errors, draw_rates, draw_stages
from navapp.evaluation.paper.rows import Row
from navapp.evaluation.report_parts import format_mm, make_picture, render_markdown

_PICTURES = (
    "The worst frame of each case that the judge calls OK: white is where the bone is, green where "
    "it is drawn. Where no frame was OK, the first one."
)


def make_report(
    tables: str,
    rows: Sequence[Row],
    pictures: Mapping[Case, bytes],
    of_the_judge: Sequence[str] = (),
) -> str:
    """The page; it needs nothing from elsewhere.

    Args:
        tables: `tables.md`.
        rows: of all cases and methods.
        pictures: JPEG of the worst frame of each case.
        of_the_judge: HTML of its charts.
    """
    parts = [render_markdown(tables)]
    parts += ["<h2>bimcc by stage and situation</h2>", draw_stages(rows)]
    parts += ["<h2>Processing time, as the paper's figure 5</h2>", draw_rates(rows)]
    parts += ["<h2>Error, as the paper's figure 6</h2>", draw_errors(rows)]
    parts += of_the_judge
    parts += ["<h2>Worst frames</h2>", make_note(_PICTURES), _show(pictures, rows)]
    return make_html("Evaluation", parts)


def _show(pictures: Mapping[Case, bytes], rows: Sequence[Row]) -> str:
    ours = {row.case: row for row in rows if row.method == OURS}
    figures = []
    for case, picture in pictures.items():
        row = ours.get(case)
        told = "" if row is None else f": mean TRE of the case {format_mm(row.tre_mm)} mm"
        figures.append(make_picture(picture, case.name + told))
    return "".join(figures)
