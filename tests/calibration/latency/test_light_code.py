"""The code, and what a frame sees of it."""

import numpy as np
import pytest

from calibration.latency.light_code import (
    LONGEST_PAUSE_MS,
    SHORTEST_PAUSE_MS,
    Switches,
    draw_pauses_ms,
)


@pytest.mark.parametrize("seconds", [0.01, 5.0, 30.0])
@pytest.mark.parametrize("seed", range(5))
def test_pauses_fill_the_time_and_end_dark(seconds: float, seed: int) -> None:
    pauses = draw_pauses_ms(seconds, seed)
    assert len(pauses) % 2 == 1
    assert pauses.min() >= SHORTEST_PAUSE_MS
    assert pauses.max() <= LONGEST_PAUSE_MS
    if seconds > 1.0:
        assert seconds * 1e3 - 2 * LONGEST_PAUSE_MS <= pauses.sum() <= seconds * 1e3
    assert np.array_equal(pauses, draw_pauses_ms(seconds, seed))


def test_a_code_looks_like_itself_at_one_delay_only() -> None:
    told = np.concatenate([[0.0], np.cumsum(draw_pauses_ms(30.0, 0))])
    times = np.arange(0.0, told[-1], 3.0)
    lags = np.arange(-800.0, 801.0, 4.0)
    shares = Switches(told).compute_lit_fractions(times, lags, 20.0)
    correlations = np.corrcoef(shares.T)[len(lags) // 2]
    far = np.abs(lags) > SHORTEST_PAUSE_MS
    assert correlations[~far].max() == pytest.approx(1.0)
    # Two pauses on, light falls on light again, but less and less.
    assert correlations[far].max() < 0.6


def test_lit_shares_are_what_counting_instants_gives() -> None:
    rng = np.random.default_rng(3)
    told = np.concatenate([[0.0], np.cumsum(draw_pauses_ms(2.0, 1))])
    times, lags, width = rng.uniform(-100.0, 2200.0, 50), np.array([-30.0, 0.0, 45.5]), 24.0
    shares = Switches(told).compute_lit_fractions(times, lags, width)
    inside = (np.arange(4000) + 0.5) / 4000 - 0.5
    for k, lag in enumerate(lags):
        instants = times[:, None] - lag + width * inside
        lit = np.searchsorted(told, instants, side="right") % 2
        np.testing.assert_allclose(shares[:, k], lit.mean(axis=1), atol=1e-3)
