import pytest

from drivers.capture_times import CaptureTimes

S, MS = 10**9, 10**6


def test_a_stamp_of_the_hosts_clock_is_the_start_of_exposure():
    times = CaptureTimes()
    assert times.of(990.0, S - 20 * MS, S, exposure_ms=8.0) == 994 * MS
    assert times.has_stamps


@pytest.mark.parametrize("stamp_ms", [0.0, 60_000.0, 1.7e12])
def test_without_a_stamp_or_with_one_of_another_clock_it_is_the_middle_of_the_grab(stamp_ms):
    times = CaptureTimes()
    assert times.of(stamp_ms, S - 20 * MS, S) == S - 10 * MS
    assert times.has_stamps is False


def test_a_picture_that_is_known_or_from_the_future_has_no_time():
    times = CaptureTimes()
    assert times.of(990.0, 0, S) == 990 * MS
    assert times.of(990.0, 0, S + 30 * MS) is None
    assert times.of(980.0, 0, S + 30 * MS) is None
    assert times.of(1031.0, 0, S + 30 * MS) is None
    assert times.of(1020.0, 0, S + 30 * MS) == 1020 * MS


def test_mid_exposure_is_never_after_the_grab():
    assert CaptureTimes().of(999.0, 0, S, exposure_ms=8.0) == S
