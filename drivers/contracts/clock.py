"""The contract of a clock."""

from collections.abc import Callable

from drivers.clock import Clock
from drivers.contracts.violation import must_return_soon, require

MakeClock = Callable[[], Clock]

_WAITS_NS = (1, 1_000, 1_000_000, 20_000_000)


def check_time_is_monotonic(make: MakeClock) -> None:
    """Time is an integer and never runs backwards."""
    clock = make()
    times_ns = [clock.now_ns() for _ in range(1000)]
    require(all(type(time_ns) is int for time_ns in times_ns), "time must be an int of ns")
    require(times_ns == sorted(times_ns), "time ran backwards")


def check_waiting_is_long_enough(make: MakeClock) -> None:
    """`wait_until_ns` returns at or after the moment, and not much later."""
    clock = make()
    for wait_ns in _WAITS_NS:
        moment_ns = clock.now_ns() + wait_ns
        with must_return_soon("waiting", wait_ns * 1e-9):
            clock.wait_until_ns(moment_ns)
        require(clock.now_ns() >= moment_ns, f"a wait of {wait_ns} ns returned too early")


def check_waiting_for_the_past(make: MakeClock) -> None:
    """Waiting for a moment that has passed returns at once and turns nothing back."""
    clock = make()
    clock.wait_until_ns(clock.now_ns() + 1_000_000)
    before_ns = clock.now_ns()
    with must_return_soon("waiting for the past", 0.0):
        clock.wait_until_ns(before_ns - 1_000_000)
    require(clock.now_ns() >= before_ns, "waiting for the past turned the clock back")


CLOCK_CHECKS: tuple[Callable[[MakeClock], None], ...] = (
    check_time_is_monotonic,
    check_waiting_is_long_enough,
    check_waiting_for_the_past,
)
