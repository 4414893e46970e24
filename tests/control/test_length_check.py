"""What several looks at a known length say together."""

from dataclasses import dataclass

import numpy as np
import pytest

from navapp.control.length_check import MOST_LOOKS, Finding, pool_lengths

WORST = 0.0009
SIGMA = 6e-5
# A third of a pixel to the side: measured as 100.13 mm.
SIDEWAYS = 1.0013


@dataclass(frozen=True)
class Look:
    ratio: float
    sigma: float = 2e-5


def looks(middle: float, scatter: float = 0.0, n: int = 6) -> list[Look]:
    return [Look(middle + scatter * (-1) ** i) for i in range(n)]


def findings(ratios, sigma: float = SIGMA) -> list[Finding]:
    """Of one showing, after every look, as the watch asks."""
    given = [Look(float(ratio), sigma) for ratio in ratios]
    return [
        pool_lengths(given[max(0, k - MOST_LOOKS) : k], 0, WORST).finding
        for k in range(1, len(given) + 1)
    ]


def test_a_right_length_is_within_and_a_wrong_one_is_off() -> None:
    assert pool_lengths(looks(1.0002), 7, WORST).finding is Finding.WITHIN
    for wrong in (1.0 - 0.0012, 1.0 + 0.0012):
        found = pool_lengths(looks(wrong), 7, WORST)
        assert found.finding is Finding.OFF
        assert found.ratio == pytest.approx(wrong)
        assert found.captured_ns == 7


def test_fewer_than_three_looks_judge_nothing() -> None:
    for n in (1, 2):
        found = pool_lengths(looks(1.01, n=n), 0, WORST)
        assert found.finding is Finding.NOT_JUDGED
        assert found.bound == pytest.approx(1.96 * 2e-5 / n**0.5, rel=1e-4)
        assert str(found) == f"{n} of 3 looks at the board"


def test_one_pool_alone_is_a_doubt_and_two_of_one_mind_an_alarm() -> None:
    for n in (3, 4, 5):
        assert pool_lengths(looks(1.01, n=n), 0, WORST).finding is Finding.DOUBTFUL
    assert pool_lengths(looks(1.01, n=6), 0, WORST).finding is Finding.OFF
    torn = [*looks(1.01, n=5), *looks(0.99, n=5)]
    assert Finding.OFF not in findings([one.ratio for one in torn])


def test_a_board_moved_about_is_not_judged_and_that_is_said() -> None:
    """Between both exposures it is as much too small as too large."""
    found = pool_lengths(looks(1.0012, scatter=0.001), 0, WORST)
    assert found.finding is Finding.NOT_JUDGED
    assert str(found) == "the board is not held still"


@pytest.mark.release
@pytest.mark.parametrize("scatter", [SIGMA, 2e-4, 1e-3, 3e-3])
def test_random_scatter_hardly_ever_alarms_in_hundreds_of_looks(scatter: float) -> None:
    rng = np.random.default_rng(7)
    showings = rng.normal(1.0, scatter, (8, 300))
    alarmed = [Finding.OFF in findings(ratios) for ratios in showings]
    assert not any(alarmed)


@pytest.mark.release
def test_a_rig_at_its_limit_hardly_ever_alarms_in_hundreds_of_looks() -> None:
    rng = np.random.default_rng(8)
    showings = rng.normal(1.0 + WORST, SIGMA, (8, 300))
    assert not any(Finding.OFF in findings(ratios) for ratios in showings)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_third_of_a_pixel_sideways_is_found_in_ten_looks(side: float) -> None:
    rng = np.random.default_rng(9)
    middle = 1.0 + side * (SIDEWAYS - 1.0)
    found = [findings(rng.normal(middle, SIGMA, 20)) for _ in range(100)]
    assert all(Finding.OFF in one for one in found)
    assert np.mean([Finding.OFF in one[:10] for one in found]) >= 0.95
    assert not any(Finding.WITHIN in one for one in found)


def test_looks_that_scatter_more_are_found_off_a_little_later() -> None:
    """A hand that trembles: a tenth of the limit, three times what the marks know."""
    rng = np.random.default_rng(10)
    found = [findings(rng.normal(1.00117, 1e-4, 40), 3e-5) for _ in range(50)]
    assert np.mean([Finding.OFF in one[:20] for one in found]) >= 0.9
    assert all(Finding.OFF in one for one in found)


def test_the_bound_holds_in_19_of_20_for_looks_whose_errors_are_known_and_for_others() -> None:
    rng = np.random.default_rng(4)
    for n, known in ((3, 1e-4), (5, 1e-4), (3, 1e-9), (5, 1e-9)):
        errors = rng.normal(0.0, 1e-4, (2000, n))
        checks = [pool_lengths([Look(1.0 + e, known) for e in row], 0, WORST) for row in errors]
        held = np.mean([abs(one.ratio - 1.0) <= one.bound for one in checks])
        assert held > 0.94


def test_it_reads_as_a_length() -> None:
    text = str(pool_lengths([Look(1.00123, 1e-4)] * 4, 0, WORST))
    assert text == "100 mm on the board are measured as 100.12 +- 0.01 mm"
