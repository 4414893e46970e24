"""The tables' layout and words."""

import pytest
from scipy.stats import beta

from navapp.evaluation.judge.figures import judge_method
from navapp.evaluation.methods import METHODS
from navapp.evaluation.paper.cases import ALL_CASES, Case
from navapp.evaluation.paper.published import CONTRADICTIONS
from navapp.evaluation.paper.rows import make_row
from navapp.evaluation.paper.tables import make_tables
from tests.evaluation.scored import done, followed, score


def tables_of(tests, *, methods=METHODS, is_quick=False) -> str:
    rows = []
    for case in dict.fromkeys(one.test.case for one in tests):
        of_case = [one for one in tests if one.test.case == case]
        rows += [make_row(case, method, of_case, of_case) for method in methods]
    judged = [
        judge_method(method, [(one.test.seed, one.scores[method].frames) for one in tests])
        for method in methods
    ]
    return make_tables(rows, judged, ["made here"], is_quick=is_quick)


def cells_of(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def tables_in(text: str) -> list[list[list[str]]]:
    found, rows = [], []
    for line in [*text.splitlines(), ""]:
        if line.startswith("|"):
            rows.append(cells_of(line))
        elif rows:
            found.append(rows)
            rows = []
    return found


def test_all_cases_make_three_tables_of_twenty_rows_in_the_papers_order() -> None:
    tests = [one for case in ALL_CASES for one in done(followed(score(0.1)), case=case)]
    text = tables_of(tests)
    *tables, judge = tables_in(text)
    assert [len(rows) for rows in tables] == [22, 22, 22, 22]
    for rows in [*tables, judge]:
        assert len({len(row) for row in rows}) == 1, "rows of unequal length"
    assert [row[0] for row in tables[0][2:] if row[0]] == [
        "opening the knee", "drilling the bone", "position of the implant",
        "resurfacing the patella", "insertion of the spacer",
    ]  # fmt: skip
    assert [line for line in text.splitlines() if line.startswith("#")] == [
        "# Evaluation on simulated knees", "## Table 1: man, 35 to 45",
        "## Table 2: woman, 35 to 45", "## Table 3: adult, 20 to 30",
        "## `bimcc` by stage and situation", "## The judge",
        "## Where the paper contradicts itself",
    ]  # fmt: skip


def test_a_row_stands_beside_the_papers_figures() -> None:
    tests = done(
        followed(score(0.1, total_ms=40.0), score(4.0, "LOST", total_ms=40.0), registration_s=0.52),
        followed(score(0.3, total_ms=40.0), score(40.0, "LOST", total_ms=40.0), registration_s=0.6),
    )
    (row,) = tables_in(tables_of(tests))[0][2:]
    assert row == [
        "opening the knee", "image registration: the leg lies still",
        "0.65, 7", "22, 11, 25, 50 %", "0.52, 15", "22, 11, 25, 50 %",
        "**0.400** (0.200 to 0.600)", "0.200 (0.100 to 0.300)", "50 %", "100 %", "25", "0.6",
    ]  # fmt: skip


def test_a_stage_and_situation_pools_the_samples_by_their_ok_frames() -> None:
    tests = [
        *done(followed(score(0.1), score(0.2)), case=Case("man", "implant", "patient")),
        *done(followed(score(0.6), score(9.0, "LOST")), case=Case("adult", "implant", "patient")),
    ]
    (row,) = tables_in(tables_of(tests))[2][2:]
    assert row == [
        "position of the implant", "the patient moves", "2", "4", "75 %", "0.300", "0.600",
        "0.600", "67 %",
    ]  # fmt: skip


def test_what_was_not_run_or_not_found_is_a_dash() -> None:
    lost = done(followed(score(None, "LOST", reasons=(), seen=None), registration_s=None))
    (row,) = tables_in(tables_of(lost))[0][2:]
    assert row[3] == row[5] == "-, -, -, 100 %"
    assert row[6:] == ["**-**", "-", "0 %", "-", "-", "-"]
    (alone,) = tables_in(tables_of(lost, methods=("icp",)))[0][2:]
    assert alone[5:] == ["-"] * 7


def test_only_chosen_cases_and_samples_are_shown() -> None:
    case = Case("woman", "implant", "patient")
    text = tables_of(done(followed(score(0.1)), case=case))
    assert "## Table 2: woman" in text
    assert "## Table 1" not in text
    assert len(tables_in(text)[0]) == 3
    assert tables_in(text)[0][2][0] == "position of the implant", "on the stage's first row"


@pytest.mark.parametrize(
    ("n_ok", "n_all", "told"),
    [(0, 400, "0 %"), (1, 400, "< 1 %"), (200, 400, "50 %"), (399, 400, "> 99 %"),
     (400, 400, "100 %")],
)  # fmt: skip
def test_only_all_frames_are_a_hundred_percent(n_ok, n_all, told) -> None:
    frames = [score(0.1)] * n_ok + [score(3.0, "LOST")] * (n_all - n_ok)
    (row,) = tables_in(tables_of(done(followed(*frames))))[0][2:]
    assert row[8] == told


def test_a_quick_look_says_that_it_is_none() -> None:
    tests = done(followed(score(0.1)))
    assert "a trial, and no results" in tables_of(tests, is_quick=True).replace("\n", " ")
    assert "no results" not in tables_of(tests)


def test_the_judges_table_counts_and_bounds() -> None:
    tests = done(followed(*[score(0.1)] * 299, score(2.0)), followed(score(0.2)))
    judge = tables_in(tables_of(tests, methods=("bimcc",)))[-1]
    assert judge[2] == [
        "`bimcc`", "301", "301", "2", "1",
        f"{100.0 * beta.ppf(0.95, 2, 300):.3f} %", f"{100.0 * beta.ppf(0.95, 2, 1):.1f} %",
        "> 99 %",
    ]  # fmt: skip


def test_words_that_must_be_there() -> None:
    text = tables_of(done(followed(score(0.1))))
    for words in ("made here", "no formula", "its judge calls OK", "in every frame with a pose",
                  *CONTRADICTIONS):  # fmt: skip
        assert words in text, words
