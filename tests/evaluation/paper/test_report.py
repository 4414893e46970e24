"""The report: one file, with everything in it."""

import base64
import re

import pytest

from navapp.evaluation.methods import METHODS
from navapp.evaluation.paper.cases import ALL_CASES
from navapp.evaluation.paper.charts import draw_errors, draw_rates
from navapp.evaluation.paper.report import make_report
from navapp.evaluation.paper.rows import make_row
from tests.evaluation.scored import done, followed, score

PICTURE = b"\xff\xd8 a picture \xff\xd9"


def rows_of(*tests, cases=ALL_CASES[:2]):
    made = {case: done(*tests, case=case) for case in cases}
    return [make_row(case, method, one, one) for case, one in made.items() for method in METHODS]


@pytest.fixture(scope="module")
def page() -> str:
    tables = "# Evaluation\n\n| a | b |\n|---|---|\n| `icp` | **0.1** |\n\n- one < two\n"
    return make_report(tables, rows_of(followed(score(0.1))), {ALL_CASES[0]: PICTURE})


def test_nothing_comes_from_elsewhere(page) -> None:
    for attribute, target in re.findall(r"\b(src|href|xlink:href)=\"([^\"]*)\"", page):
        assert target.startswith(("data:image/jpeg;base64,", "#")), (attribute, target[:60])
    assert "<script" not in page
    assert "@import" not in page
    # Names of SVG's vocabularies are no addresses.
    without_names = re.sub(r"xmlns(:\w+)?=\"[^\"]*\"", "", page)
    assert "http" not in without_names


def test_pictures_are_embedded(page) -> None:
    (data,) = re.findall(r"base64,([^\"]+)", page)
    assert base64.b64decode(data) == PICTURE
    assert "man-opening-registration: mean TRE of the case 0.100 mm" in page


def test_markdown_is_rendered(page) -> None:
    for words in ("<h1>Evaluation</h1>", "<th>a</th>", "<td><code>icp</code></td>",
                  "<strong>0.1</strong>", "<li>one &lt; two</li>"):  # fmt: skip
        assert words in page, words
    assert "|---" not in page
    assert page.count("<svg") == 3


def heights_of(svg: str, colour: str) -> list[float]:
    """Of the bars in a colour: paths of four corners."""
    found = []
    for path in re.findall(rf'<path d="([^"]+)"[^>]*fill: {colour}', svg):
        ys = [float(y) for _, y in re.findall(r"[ML] (\S+) (\S+)", path)]
        found.append(max(ys) - min(ys))
    return found[: len(found) - 1]  # the last one is the legend's


def test_bars_are_as_high_as_the_median_of_the_cases() -> None:
    rows = [
        *rows_of(followed(score(0.1)), cases=ALL_CASES[0:1]),
        *rows_of(followed(score(0.2)), cases=ALL_CASES[4:5]),  # registration too
        *rows_of(followed(score(0.4)), cases=ALL_CASES[8:9]),
        *rows_of(followed(score(0.8)), cases=ALL_CASES[1:2]),  # overlay
    ]
    first, second = heights_of(draw_errors(rows), "#2b6cb0")
    assert second / first == pytest.approx(4.0, rel=1e-3)


def words_of(svg: str) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]+)</text>", svg)


def test_what_has_no_figure_says_so_and_a_cut_bar_tells_its_height() -> None:
    # A bar of height 0 would look like the best of all.
    svg = draw_errors(rows_of(followed(score(3.0, "LOST")), cases=ALL_CASES[:4]))
    assert heights_of(svg, "#2b6cb0") == []
    assert words_of(svg).count("none") == 4
    assert len(heights_of(svg, "#718096")) == 4
    assert words_of(svg).count("6.0") == 8  # icp and paper
    fine = draw_errors(rows_of(followed(score(0.1)), cases=ALL_CASES[:4]))
    assert not {"none", "6.0"} & set(words_of(fine))


def test_rates_are_drawn_as_well() -> None:
    rows = rows_of(followed(score(0.1, total_ms=50.0)), cases=ALL_CASES[0:1])
    ours, theirs = (heights_of(draw_rates(rows), one) for one in ("#2b6cb0", "#cbd5e0"))
    # 20 a second beside the 7 of the paper's state of the art.
    assert ours[0] / theirs[0] == pytest.approx(20.0 / 7.0, rel=1e-3)
