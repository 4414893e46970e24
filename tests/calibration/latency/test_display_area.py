"""Which cells are the display, and whether any is."""

import numpy as np
import pytest

from calibration.latency.display_area import WatchedCells, compute_seen_deviations, find_area
from tests.calibration.latency.scenes import AREA, N_CELLS, drawn_bench


@pytest.mark.parametrize("seed", range(4))
def test_the_cells_of_the_display_are_found(seed: int) -> None:
    bench = drawn_bench(seed)
    switches, left, _ = bench.record(seed)
    area = find_area(switches, left)
    assert np.array_equal(np.flatnonzero(area.is_in), np.arange(N_CELLS)[AREA])
    assert area.lag_ms == pytest.approx(bench.true_delay_ms, abs=10.0)


def test_something_else_that_moves_more_is_not_the_display() -> None:
    switches, left, _ = drawn_bench(1, contrast=20.0).record(1)
    cells = left.cells.copy()
    cells[:, 30:40] += 60.0 * np.sin(2 * np.pi * left.times_ms / 311.0)[:, None]
    area = find_area(switches, WatchedCells(left.times_ms, cells.astype(np.float32)))
    assert np.array_equal(np.flatnonzero(area.is_in), np.arange(N_CELLS)[AREA])


def test_noise_is_not_seen_however_many_cells_there_are() -> None:
    switches, left, _ = drawn_bench(0).record(0)
    rng = np.random.default_rng(0)
    looks = [
        compute_seen_deviations(
            switches, WatchedCells(left.times_ms, rng.normal(0, 5, (len(left.times_ms), 576)))
        )
        for _ in range(20)
    ]
    # Standard deviations, as of drawn numbers: neither all the same nor large.
    assert np.abs(looks).max() < 4.0
    assert 0.4 < np.std(looks) < 1.8


def test_a_display_that_is_there_is_surely_seen() -> None:
    switches, left, _ = drawn_bench(2).record(2)
    assert compute_seen_deviations(switches, left) > 10.0
