"""What the findings say: lines of the tables, charts, and values for programs."""

import json

import pytest

from navapp.evaluation.judge.findings import examine_judge
from navapp.evaluation.report_parts import render_markdown
from navapp.evaluation.scores import ErrorBudget
from tests.evaluation.scored import score

CLAIMED = (0.1, 0.2, 0.3, 0.4)
BUDGET = ErrorBudget(0.01, 0.02, 0.05, 0.06)


@pytest.fixture(scope="module")
def found():
    ok = [score(0.15, claimed_mm=CLAIMED, bound_mm=0.3, rms_ratio=1.0, budget=BUDGET)] * 9
    wrong = score(2.0, "DEGRADED", claimed_mm=CLAIMED, bound_mm=1.5, rms_ratio=1.5)
    lost = score(None, "LOST", bound_mm=None)
    return examine_judge({"registration": [ok, [*ok, wrong, lost]], "patient": [ok]})


def cells(lines: list[str], first: str) -> list[str]:
    line = next(one for one in lines if one.startswith(f"| {first} "))
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_lines_hold_the_figures(found) -> None:
    lines = found.to_lines()
    assert [one for one in lines if one.startswith("## ")] == [
        "## The judge as a rejector", "## How often the bound holds", "## Noise limit",
    ]  # fmt: skip
    bound = cells(lines, "the judge's bound")
    assert bound[1:3] == ["0.216 (0.150)", "0.150 (0.150)"]
    assert bound[-1] == "1.000"
    text = "\n".join(lines)
    assert "All 28 frames of `bimcc` with a pose" in text
    assert "; 1 without one" in text
    assert "refuses 100.0 % of 1 frames that are further off than 1 mm, and 0.0 % of 27" in text
    assert cells(lines, "50 %")[1:] == ["0.0 % (0.0 to 0.0)"] * 2
    assert cells(lines, "95 %")[1:] == ["100.0 % (100.0 to 100.0)"] * 2
    assert cells(lines, "the patient moves")[1] == "2.0"
    limit = [one for one in lines if one.startswith("| image registration")][-1]
    assert limit.split(" | ")[1:] == [
        "18", "2", "0.0100", "0.0200", "0.0500", "0.0600", "0.028",
        "+0.00030, +0.00210, +0.00110", "the matcher |",
    ]  # fmt: skip


def test_rows_of_a_table_are_of_one_length(found) -> None:
    html = render_markdown("\n".join(found.to_lines()))
    assert html.count("<table>") == 4
    widths = [line.count("|") for line in found.to_lines() if line.startswith("|")]
    assert set(widths) == {4, 8, 11}


def test_charts_are_drawn(found) -> None:
    page = "".join(found.draw())
    assert page.count("<svg") == 2
    for words in ("by the bound", "not OK", "nominal, %", "frames rejected, %"):
        assert words in page, words


def test_programs_get_the_same(found) -> None:
    told = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert told["judge"]["rejector"]["by"]["bound"]["auc"] == 1.0
    assert told["judge"]["reliability"][2]["observed"] == 1.0
    assert told["judge"]["sharpness"]["registration"]["median"] == pytest.approx(2.0)
    assert told["noise_limit"]["registration"]["largest_step"] == "matcher"


def test_nothing_followed_says_nothing() -> None:
    none = examine_judge({"patient": [[score(None, "LOST")]]})
    assert none.to_lines() == []
    assert none.draw() == []
    assert none.to_json() == {"judge": {"rejector": None}, "noise_limit": {}}
    right = examine_judge({"patient": [[score(0.1, claimed_mm=CLAIMED)]]})
    assert "No frame with a pose is further off than 1 mm" in "\n".join(right.to_lines())
    assert "none beyond 1 mm" in "".join(right.draw())
