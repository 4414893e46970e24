"""How often bounds hold, against draws whose distribution is known."""

import json
import math

import numpy as np
import pytest

from navapp.evaluation.judge.reliability import find_bound_mm, judge_bounds
from navapp.evaluation.scores import LEVELS
from tests.evaluation.scored import score

# Of the length of a vector of three unit normal numbers.
QUANTILES = (1.5382, 2.1544, 2.7955, 3.3682)


def drawn(rng: np.random.Generator, factor: float, n_frames: int = 400):
    """OK frames whose errors have a standard deviation of 0.1 mm, bounds being too large by it."""
    claimed = tuple(0.1 * factor * one for one in QUANTILES)
    errors = 0.1 * np.linalg.norm(rng.standard_normal((n_frames, 3)), axis=1)
    return [score(float(mm), bound_mm=claimed[2], claimed_mm=claimed) for mm in errors]


def test_right_bounds_hold_as_often_as_they_say() -> None:
    rng = np.random.default_rng(4)
    found = judge_bounds({"overlay": [drawn(rng, 1.0) for _ in range(8)]})
    assert [one.nominal for one in found.levels] == list(LEVELS)
    for one in found.levels:
        # 3200 draws: a standard deviation of at most 0.009.
        assert one.observed == one.claimed == pytest.approx(one.nominal, abs=0.03)
        assert one.ci95[0] <= one.observed <= one.ci95[1]
        assert (one.n_frames, one.n_knees) == (3200, 8)
    # The bound over the median error: 2.7955 / 1.5382.
    assert found.sharpness["overlay"].median == pytest.approx(1.817, abs=0.08)


@pytest.mark.parametrize(("factor", "sign"), [(0.5, -1), (2.0, 1)])
def test_bounds_that_are_too_small_or_too_large_show(factor, sign) -> None:
    found = judge_bounds({"overlay": [drawn(np.random.default_rng(5), factor)]})
    assert all(sign * (one.observed - one.nominal) > 0.0 for one in found.levels)
    assert found.sharpness["all"].median == pytest.approx(1.817 * factor, rel=0.1)
    assert found.levels[0].ci95 is None, "one knee has no interval"


def test_the_interval_draws_knees() -> None:
    claimed = (0.2, 0.3, 0.4, 0.5)
    good, bad = ([score(mm, claimed_mm=claimed, bound_mm=0.4)] * 50 for mm in (0.1, 1.0))
    level = judge_bounds({"patient": [good, bad]}).levels[2]
    assert level.observed == 0.5
    assert level.ci95 == pytest.approx((0.0, 1.0))


def test_what_the_judge_adds_counts_at_every_level() -> None:
    claimed = (0.1, 0.2, 0.3, 0.5)
    frame = score(0.1, claimed_mm=claimed, bound_mm=0.5)  # 0.4 added at 95 %
    assert find_bound_mm(frame, 2) == pytest.approx(0.5)
    # Of a normal error: 0.6745, 1.2816 and 2.5758 standard deviations, against 1.9600.
    for number, sigmas in ((0, 0.6745), (1, 1.2816), (3, 2.5758)):
        added = 0.4 * sigmas / 1.9600
        assert find_bound_mm(frame, number) == pytest.approx(
            math.hypot(claimed[number], added), rel=1e-4
        )
    alone = score(0.1, claimed_mm=claimed, bound_mm=0.3)
    assert find_bound_mm(alone, 0) == pytest.approx(0.1)
    level = judge_bounds({"overlay": [[score(0.3, claimed_mm=claimed, bound_mm=0.5)]]}).levels[1]
    assert (level.observed, level.claimed) == (1.0, 0.0)


def test_only_ok_frames_with_bounds_count() -> None:
    claimed = (0.1, 0.2, 0.3, 0.5)
    frames = [
        score(0.1, claimed_mm=claimed), score(9.0, "DEGRADED", claimed_mm=claimed),
        score(9.0), score(None, claimed_mm=claimed), score(9.0, bound_mm=None, claimed_mm=claimed),
    ]  # fmt: skip
    found = judge_bounds({"overlay": [frames], "patient": [[score(0.1, "LOST")]]})
    assert found.levels[0].n_frames == 1
    assert set(found.sharpness) == {"all", "overlay"}
    assert judge_bounds({"overlay": [[score(0.1, "LOST", claimed_mm=claimed)]]}) is None
    json.dumps(found.to_json(), allow_nan=False)
