"""What several looks at a known length say together."""

from dataclasses import dataclass

import numpy as np
import pytest

from navapp.control.length_check import pooled

WORST = 0.0009


@dataclass(frozen=True)
class Look:
    ratio: float
    sigma: float = 2e-5


def looks(middle: float, scatter: float = 0.0, n: int = 4) -> list[Look]:
    return [Look(middle + scatter * (-1) ** i) for i in range(n)]


def test_a_right_length_is_within_and_a_wrong_one_is_off() -> None:
    assert pooled(looks(1.0002), 7, WORST).is_within
    for wrong in (1.0 - 0.0012, 1.0 + 0.0012):
        found = pooled(looks(wrong), 7, WORST)
        assert found.is_off
        assert not found.is_within
        assert found.ratio == pytest.approx(wrong)
        assert found.captured_ns == 7


def test_fewer_than_three_looks_judge_nothing() -> None:
    for n in (1, 2):
        found = pooled(looks(1.01, n=n), 0, WORST)
        assert not (found.is_judged)
        assert not (found.is_off)
        assert not (found.is_within)
        assert found.bound == pytest.approx(1.96 * 2e-5 / n**0.5)
    assert pooled(looks(1.01, n=3), 0, WORST).is_off


def test_looks_that_scatter_say_neither() -> None:
    """A board that moves between both exposures is as much too small as too large."""
    found = pooled(looks(1.0012, scatter=0.001), 0, WORST)
    assert found.is_judged
    assert not (found.is_off)
    assert not (found.is_within)


def test_the_bound_holds_in_19_of_20_for_looks_whose_errors_are_known_and_for_others() -> None:
    rng = np.random.default_rng(4)
    for n, known in ((3, 1e-4), (5, 1e-4), (3, 1e-9), (5, 1e-9)):
        errors = rng.normal(0.0, 1e-4, (2000, n))
        checks = [pooled([Look(1.0 + e, known) for e in row], 0, WORST) for row in errors]
        held = np.mean([abs(one.ratio - 1.0) <= one.bound for one in checks])
        assert held > 0.94


def test_it_reads_as_a_length() -> None:
    text = str(pooled([Look(1.00123, 1e-4)] * 4, 0, WORST))
    assert text == "100 mm on the board are measured as 100.12 +- 0.01 mm"
