"""The sums from which lags are found."""

import numpy as np
import pytest

from calibration.latency.lag_fit import compute_block_sums, draw_counts, list_fine_lags_ms
from calibration.latency.light_code import Switches, draw_pauses_ms

TOLD = Switches(np.concatenate([[0.0], np.cumsum(draw_pauses_ms(10.0, 4))]))
TIMES = np.linspace(0.0, 10_000.0, 240)
BLOCKS = [slice(n, n + 24) for n in range(0, 240, 24)]
LAGS = list_fine_lags_ms(50.0)
ONCE = np.ones((1, len(BLOCKS)))


def seen(lag_ms: float) -> np.ndarray:
    return 20.0 + 90.0 * TOLD.compute_lit_fractions(TIMES, np.array([lag_ms]), 16.0)[:, 0]


def sums_of(grey: np.ndarray):
    return compute_block_sums(TOLD.compute_lit_fractions(TIMES, LAGS, 16.0), grey, BLOCKS, LAGS)


@pytest.mark.parametrize("lag_ms", [12.0, 47.75, 101.5])
def test_the_true_lag_explains_everything(lag_ms: float) -> None:
    sums = sums_of(seen(lag_ms))
    assert sums.best_lags_ms(ONCE)[0] == pytest.approx(lag_ms, abs=0.01)
    assert sums.compute_explained(ONCE).max() == pytest.approx(1.0)


def test_an_upside_down_code_explains_nothing() -> None:
    assert sums_of(-seen(50.0)).compute_explained(ONCE)[0, len(LAGS) // 2] == 0.0


def test_light_that_changes_slowly_moves_no_lag() -> None:
    steps = np.repeat(np.arange(10) * 40.0, 24)
    assert sums_of(seen(61.0) + steps).best_lags_ms(ONCE)[0] == pytest.approx(61.0, abs=0.01)


def test_lags_that_explain_as_much_are_answered_by_their_middle() -> None:
    grey = seen(50.0)
    sums = sums_of(grey)
    flat = np.where(np.abs(LAGS - 40.0) <= 2.0, 1.0, 0.5)
    same = type(sums)(LAGS, flat[None], np.ones((1, len(LAGS))), np.ones(1))
    assert same.best_lags_ms(np.ones((1, 1)))[0] == pytest.approx(40.0)


def test_draws_count_every_block_as_often_on_average() -> None:
    counts = draw_counts(12)
    assert (counts.sum(axis=1) == 12).all()
    np.testing.assert_allclose(counts.mean(axis=0), 1.0, atol=0.25)
    assert counts.std() > 0.8
    half = draw_counts(12, np.arange(12) < 6)
    assert (half.sum(axis=1) == 6).all()
    assert not half[:, 6:].any()
