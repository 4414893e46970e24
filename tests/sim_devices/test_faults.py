import math

import pytest

from sim_devices.faults import Fault, FaultKind, FaultScript

S = 1_000_000_000


def test_fault_is_active_from_its_start_to_before_its_end():
    script = FaultScript((Fault(FaultKind.DROP, 1.0, 0.5),))
    times_ns = (S - 1, S, S + S // 2 - 1, S + S // 2)
    assert [script.is_active(FaultKind.DROP, t) for t in times_ns] == [False, True, True, False]
    assert not script.is_active(FaultKind.FREEZE, S)


def test_endless_fault_stays():
    script = FaultScript((Fault(FaultKind.UNPLUG, 1.0, math.inf),))
    assert script.is_active(FaultKind.UNPLUG, 10**18)
    assert not script.is_active(FaultKind.UNPLUG, 0)


def test_longest_active_delay_counts():
    script = FaultScript(
        (Fault(FaultKind.DELAY, 0.0, 2.0, 0.1), Fault(FaultKind.DELAY, 1.0, 2.0, 0.4))
    )
    assert [script.delay_ns(round(t * S)) for t in (0.5, 1.5, 2.5, 3.5)] == [
        100_000_000,
        400_000_000,
        400_000_000,
        0,
    ]


def test_a_turn_lasts_as_long_as_it_is_written_and_the_last_one_counts():
    script = FaultScript(
        (
            Fault(FaultKind.TURN, 1.0, 2.0, turn_deg=(0.0, 90.0, 0.0)),
            Fault(FaultKind.TURN, 2.0, 5.0, turn_deg=(180.0, 0.0, 0.0)),
        )
    )
    found = [script.turn_rad(round(t * S)) for t in (0.5, 1.5, 2.5, 7.5)]
    quarter, half = (0.0, math.pi / 2, 0.0), (math.pi, 0.0, 0.0)
    assert found == [(0.0, 0.0, 0.0), quarter, half, (0.0, 0.0, 0.0)]
    with pytest.raises(ValueError, match="three numbers"):
        Fault(FaultKind.TURN, 0.0, 1.0, turn_deg=(0.0, math.nan, 0.0))


def test_first_moment_finds_faults_that_began_earlier_or_in_between():
    script = FaultScript((Fault(FaultKind.UNPLUG, 2.0, 1.0), Fault(FaultKind.UNPLUG, 5.0, 1.0)))
    find = script.first_moment_ns
    assert find(FaultKind.UNPLUG, 0, S) is None
    assert find(FaultKind.UNPLUG, 0, 2 * S) == 2 * S
    assert find(FaultKind.UNPLUG, 0, 9 * S) == 2 * S
    assert find(FaultKind.UNPLUG, 5 * S // 2, 9 * S) == 5 * S // 2
    assert find(FaultKind.UNPLUG, 3 * S, 9 * S) == 5 * S
    assert find(FaultKind.UNPLUG, 6 * S, 9 * S) is None


@pytest.mark.parametrize(
    ("times_s", "message"),
    [
        ((-1.0, 1.0), "start_s must not be negative"),
        ((math.nan, 1.0), "start_s must not be negative"),
        ((0.0, 0.0), "duration_s must be positive"),
        ((0.0, 1.0, -1.0), "delay_s must not be negative"),
    ],
)
def test_impossible_times_are_refused(times_s, message):
    with pytest.raises(ValueError, match=message):
        Fault(FaultKind.DELAY, *times_s)
