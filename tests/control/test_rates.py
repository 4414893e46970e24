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


def test_capture_to_light_has_the_displays_delay_and_its_error_in_it() -> None:
    meter = RateMeter(40.0, 3.0)
    for _ in range(9):
        meter.add(50.0, 0)
    # Of so few frames no spread is told.
    assert meter.rates(0).light is None
    for _ in range(31):
        meter.add(50.0, 0)
    light = meter.rates(0).light
    assert light is not None
    assert (light.mean_ms, light.spread_ms) == (90.0, 3.0)
    for k in range(40):
        meter.add(50.0 + 4.0 * (-1) ** k, 0)
    spread = meter.rates(0).light
    assert spread is not None
    assert (spread.mean_ms, spread.spread_ms) == (90.0, 5.0)


def test_without_a_known_delay_and_its_error_no_light_is_told() -> None:
    for meter in (RateMeter(), RateMeter(40.0)):
        for _ in range(40):
            meter.add(50.0, 0)
        assert meter.rates(0).light is None
