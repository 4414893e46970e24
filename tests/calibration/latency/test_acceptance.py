"""Delays that nobody chose are found again; what cannot be believed is refused in a sentence."""

import numpy as np
import pytest

from calibration.latency.acceptance import WORST_MS, measure_accepted_latency
from calibration.latency.display_area import WatchedCells
from navapp.errors import ResultError
from tests.calibration.latency.scenes import CASES, Bench, drawn_bench
from tests.many import few_of

GOOD = (
    "15 Hz", "25 Hz, 5 ms", "30 Hz, 30 ms", "60 Hz", "display of 144 Hz",
    "display without refresh",
)  # fmt: skip


def judged(bench: Bench, seed: int):
    # A display without refresh is one of very many.
    return measure_accepted_latency(*bench.record(seed), refresh_hz=bench.refresh_hz or 240.0)


@pytest.mark.parametrize("name", few_of(GOOD, 2))
@pytest.mark.parametrize("seed", few_of(range(4)))
def test_delay_and_offset_are_recovered(name: str, seed: int) -> None:
    bench = drawn_bench(seed, **CASES[name])
    found = judged(bench, seed)
    assert found.delay.value_ms == pytest.approx(bench.true_delay_ms, abs=WORST_MS)
    assert found.offset.value_ms == pytest.approx(bench.true_offset_ms, abs=WORST_MS)
    assert found.late.value_ms == pytest.approx(bench.right_late_ms, abs=WORST_MS)
    assert found.stamped_ms == pytest.approx(bench.skew_ms, abs=0.5)


@pytest.mark.parametrize("seed", few_of(range(4)))
def test_jitter_noise_and_dropped_frames_are_borne(seed: int) -> None:
    bench = drawn_bench(seed, rate_hz=25.0, **CASES["jitter, a third dropped"])
    found = judged(bench, seed)
    assert found.delay.value_ms == pytest.approx(bench.true_delay_ms, abs=WORST_MS)
    assert found.offset.value_ms == pytest.approx(bench.true_offset_ms, abs=WORST_MS)


@pytest.mark.release
@pytest.mark.slow
def test_errors_are_what_is_claimed() -> None:
    ratios = []
    for seed in range(40):
        bench = drawn_bench(100 + seed)
        found = judged(bench, 100 + seed)
        delay_ms = found.delay.value_ms - bench.true_delay_ms
        offset_ms = found.offset.value_ms - bench.true_offset_ms
        assert max(abs(delay_ms), abs(offset_ms)) < WORST_MS
        ratios.append((delay_ms / found.delay.sigma_ms, offset_ms / found.offset.sigma_ms))
    # Of 40 draws of a unit normal the rms is 0.78 to 1.22 in 19 of 20 cases.
    rms = np.sqrt(np.mean(np.square(ratios), axis=0))
    assert (rms > 0.6).all()
    assert (rms < 1.3).all()
    assert np.abs(np.mean(ratios, axis=0)).max() < 0.5


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("5 Hz", "frames in 30 s, 200 are needed"),
        ("not in view", "neither camera sees the display flash"),
        ("left eye covered", "left camera does not see"),
        ("a fifth 35 ms late", "the delay is not steady"),
        ("70 ms more from the middle on", "several delays fit|a single delay explains only"),
        ("drift of 20 ms", "the delay drifts"),
        ("in step: display of 60 Hz", "in step with the display"),
    ],
)
def test_what_cannot_be_believed_is_refused(name: str, words: str) -> None:
    with pytest.raises(ResultError, match=words):
        judged(drawn_bench(1, **CASES[name]), 1)


def test_a_covered_right_eye_is_named() -> None:
    with pytest.raises(ResultError, match="the right camera does not see"):
        judged(drawn_bench(1, blocked="right"), 1)


def test_a_display_that_is_hardly_brighter_than_noise_is_refused() -> None:
    with pytest.raises(ResultError, match="a single delay explains only"):
        judged(drawn_bench(1, contrast=2.0, noise_levels=4.0), 1)


def test_light_that_goes_with_darkness_is_refused() -> None:
    switches, left, right = drawn_bench(2).record(2)
    inverted = WatchedCells(left.times_ms, 255.0 - left.cells)
    with pytest.raises(ResultError, match="left camera"):
        measure_accepted_latency(switches, inverted, right, refresh_hz=59.94)


def test_a_result_that_may_be_off_by_more_than_is_promised_is_refused() -> None:
    bench = drawn_bench(2, rate_hz=10.0, seconds=21.0, contrast=6.0, noise_levels=4.0)
    with pytest.raises(ResultError, match=r"is known to 3\.\d ms only"):
        judged(bench, 2)
