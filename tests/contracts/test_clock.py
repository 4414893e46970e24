"""Both clocks keep the contract, and the contract notices clocks that do not."""

import time

import pytest

from drivers.clock import ManualClock, SystemClock
from drivers.contracts import CLOCK_CHECKS, ContractViolation


@pytest.mark.parametrize("check", CLOCK_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("kind", [SystemClock, ManualClock])
def test_clock_keeps_its_contract(kind, check):
    check(kind)


class RunsBackwards(ManualClock):
    def now_ns(self):
        self._now_ns -= 1
        return self._now_ns


class CountsInFloats(ManualClock):
    def now_ns(self):
        return time.monotonic() * 1e9


class ReturnsEarly(SystemClock):
    def wait_until_ns(self, moment_ns):
        pass


class TurnsBack(ManualClock):
    def wait_until_ns(self, moment_ns):
        self._now_ns = moment_ns


@pytest.mark.parametrize("kind", [RunsBackwards, CountsInFloats, ReturnsEarly, TurnsBack])
def test_broken_clocks_are_caught(kind):
    def run_all() -> None:
        for check in CLOCK_CHECKS:
            check(kind)

    with pytest.raises(ContractViolation):
        run_all()
