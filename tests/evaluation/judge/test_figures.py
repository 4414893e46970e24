"""Wrong poses that the judge called OK, by frames and by knees."""

from collections.abc import Sequence

import pytest
from scipy.stats import beta, binomtest

from navapp.evaluation.campaign import Done
from navapp.evaluation.judge.figures import find_upper_limit, judge_method
from navapp.evaluation.scores import FrameScore
from tests.evaluation.scored import done, followed, score
from tests.evaluation.stressed import stressed


def by_knee(tests: Sequence[Done], method: str) -> list[tuple[int, Sequence[FrameScore]]]:
    return [(one.test.seed, one.scores[method].frames) for one in tests]


@pytest.mark.parametrize(("k", "n"), [(0, 1), (0, 300), (1, 300), (7, 12000), (11, 12)])
def test_the_upper_limit_is_that_of_clopper_and_pearson(k, n) -> None:
    assert find_upper_limit(k, n) == pytest.approx(beta.ppf(0.95, k + 1, n - k), rel=1e-9)
    # Two-sided at 90 % has 5 % above, as one-sided at 95 %.
    assert find_upper_limit(k, n) == pytest.approx(binomtest(k, n).proportion_ci(0.90).high)


def test_the_upper_limit_of_nothing_and_of_all_is_one() -> None:
    assert find_upper_limit(0, 0) == find_upper_limit(3, 3) == 1.0
    assert find_upper_limit(0, 300) == pytest.approx(0.00994, abs=1e-5)  # the rule of three


def test_frames_and_knees_are_counted() -> None:
    tests = done(
        followed(score(0.1), score(0.9), score(2.0)),  # OK, wrong once
        followed(score(0.1), score(4.0, "DEGRADED")),
        followed(score(None, "LOST"), score(9.0, "LOST")),  # never OK
        followed(score(3.0), score(3.0)),  # wrong twice
    )
    judged = judge_method("bimcc", by_knee(tests, "bimcc"))
    assert (judged.figures.n_frames, judged.figures.n_ok, judged.n_knees) == (9, 6, 3)
    assert (judged.figures.n_wrong, judged.n_wrong_knees) == (3, 2)
    assert judged.figures.bound_coverage == pytest.approx(2 / 6)
    by_frames, by_knees = judged.find_upper_limits()
    assert by_frames == pytest.approx(beta.ppf(0.95, 4, 3))
    assert by_knees == pytest.approx(beta.ppf(0.95, 3, 1))
    told = judged.to_json()
    assert told["wrong_share_at_most"] == {"of_ok_frames": by_frames, "of_knees": by_knees}


def test_a_knee_counts_once_at_however_many_levels() -> None:
    wrong = (score(0.1), score(3.0))
    tests = stressed("light", {1.0: (wrong, [score(0.1)]), 0.5: (wrong, [score(0.1)])})
    judged = judge_method("bimcc", by_knee(tests, "bimcc"))
    assert (judged.n_knees, judged.n_wrong_knees, judged.figures.n_wrong) == (2, 1, 2)


def test_nothing_ok_says_nothing() -> None:
    judged = judge_method("icp", by_knee(done(followed(score(5.0, "LOST"))), "icp"))
    assert (judged.figures.n_ok, judged.figures.bound_coverage, judged.find_upper_limits()) == (
        0,
        None,
        (1.0, 1.0),
    )
