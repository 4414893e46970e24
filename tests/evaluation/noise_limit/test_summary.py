"""Efficiencies by situation, from budgets by hand."""

import json

import pytest

from navapp.evaluation.noise_limit.summary import compare_with_limit
from navapp.evaluation.scores import ErrorBudget
from tests.evaluation.scored import score


def frame(limit, ideal, matched, reached, status="OK"):
    return score(reached, status, budget=ErrorBudget(limit, ideal, matched, reached))


def test_variances_are_pooled_over_ok_frames_of_all_knees() -> None:
    knees = [
        [frame(0.03, 0.03, 0.04, 0.05), score(0.1)],
        [frame(0.01, 0.03, 0.04, 0.07), frame(9.0, 9.0, 9.0, 9.0, "DEGRADED")],
        [score(0.1)],
    ]
    found = compare_with_limit({"overlay": knees, "patient": [[score(0.2)]]})
    assert set(found) == {"overlay"}
    one = found["overlay"]
    assert (one.n_frames, one.n_knees) == (2, 2)
    assert one.limit_mm**2 == pytest.approx((9e-4 + 1e-4) / 2)
    assert one.efficiency == pytest.approx((9e-4 + 1e-4) / (25e-4 + 49e-4))
    assert one.ideal_mm == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("budget", "largest"),
    [
        ((0.02, 0.05, 0.06, 0.065), "pictures"),
        ((0.02, 0.03, 0.06, 0.065), "matcher"),
        ((0.02, 0.025, 0.03, 0.06), "fit"),
        ((0.02, 0.08, 0.03, 0.04), "pictures"),  # later steps make up for it
        ((0.05, 0.055, 0.06, 0.065), None),  # more than half of the variance is noise
    ],
)
def test_the_step_that_adds_most_is_told_where_the_efficiency_is_low(budget, largest) -> None:
    one = compare_with_limit({"overlay": [[frame(*budget)]]})["overlay"]
    assert one.largest_step == largest
    assert sum(one.added_mm2.values()) == pytest.approx(budget[3] ** 2 - budget[0] ** 2)
    json.dumps(one.to_json(), allow_nan=False)
