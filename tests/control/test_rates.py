from navapp.control.rates import RateMeter
from tests.control.fakes import Bench


def test_rate_and_latency_are_those_of_the_newest_frames() -> None:
    meter = RateMeter()
    assert meter.rates(0).latency_ms is None
    for latency_ms in (30.0, 50.0):
        meter.add(latency_ms, 400_000)
    rates = meter.rates(7)
    assert rates.latency_ms == 50.0
    assert rates.latency_history_ms == (30.0, 50.0)
    assert rates.frames_per_s > 0.0
    assert (rates.n_frames, rates.n_dropped, rates.skew_ms) == (2, 7, 0.4)


def test_frames_that_wait_to_be_read_have_a_rate_and_no_latency(bench: Bench) -> None:
    rates = bench.frames(3).rates
    assert rates.n_frames == 3
    assert rates.latency_ms is None
    assert rates.latency_history_ms == ()
