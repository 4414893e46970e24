import time

import pytest

from drivers.clock import ManualClock, SystemClock


def test_manual_clock_stands_until_it_is_moved():
    clock = ManualClock(5)
    assert clock.now_ns() == clock.now_ns() == 5
    clock.advance_ns(3)
    assert clock.now_ns() == 8
    clock.wait_until_ns(20)
    clock.wait_until_ns(10)
    assert clock.now_ns() == 20


def test_manual_clock_cannot_run_backwards():
    with pytest.raises(ValueError, match="backwards"):
        ManualClock().advance_ns(-1)


def test_system_clock_sleeps_again_when_woken_too_early(monkeypatch):
    naps: list[float] = []

    def short_sleep(duration_s: float) -> None:
        naps.append(duration_s)
        monkeypatch.undo()  # the first nap alone ends too early

    clock = SystemClock()
    monkeypatch.setattr(time, "sleep", short_sleep)
    moment_ns = clock.now_ns() + 10_000_000
    clock.wait_until_ns(moment_ns)
    assert len(naps) == 1
    assert clock.now_ns() >= moment_ns
