"""What the tables say of ours beside the paper's figures."""

from navapp.evaluation.paper.cases import ALL_CASES
from navapp.evaluation.paper.published import find_published
from navapp.evaluation.paper.rows import make_row
from navapp.evaluation.paper.summary import compare_with_paper
from tests.evaluation.scored import done, followed, score


def test_cases_are_counted_against_the_papers_own_figures() -> None:
    rows = []
    for case, tre_mm, total_ms in zip(ALL_CASES[:4], (0.01, 0.01, 5.0, None), (10, 500, 10, 10),
                                      strict=True):  # fmt: skip
        one = followed(score(tre_mm, "OK" if tre_mm else "LOST", total_ms=total_ms))
        tests = done(one, case=case)
        rows += [make_row(case, method, tests, tests) for method in ("paper", "bimcc")]
    assert find_published(ALL_CASES[1].__class__("man", "opening", "overlay")).paper_mm == 0.40
    assert compare_with_paper(rows) == {"cases": 4, "nearer": 2, "faster": 3}
    assert compare_with_paper([]) == {"cases": 0, "nearer": 0, "faster": 0}
