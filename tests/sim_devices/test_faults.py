import math

import pytest

from navapp.errors import ConfigurationError
from sim_devices.faults import Fault, FaultKind, FaultScript, fault_script

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


def test_first_moment_finds_faults_that_began_earlier_or_in_between():
    script = FaultScript((Fault(FaultKind.UNPLUG, 2.0, 1.0), Fault(FaultKind.UNPLUG, 5.0, 1.0)))
    find = script.first_moment_ns
    assert find(FaultKind.UNPLUG, 0, S) is None
    assert find(FaultKind.UNPLUG, 0, 2 * S) == 2 * S
    assert find(FaultKind.UNPLUG, 0, 9 * S) == 2 * S
    assert find(FaultKind.UNPLUG, 5 * S // 2, 9 * S) == 5 * S // 2
    assert find(FaultKind.UNPLUG, 3 * S, 9 * S) == 5 * S
    assert find(FaultKind.UNPLUG, 6 * S, 9 * S) is None


def test_script_is_read_from_tables():
    script = fault_script(
        [
            {"kind": "unplug", "start_s": 3, "duration_s": 1.5},
            {"kind": "delay", "start_s": 0, "duration_s": math.inf, "delay_s": 0.2},
        ]
    )
    assert script.faults == (
        Fault(FaultKind.UNPLUG, 3.0, 1.5),
        Fault(FaultKind.DELAY, 0.0, math.inf, 0.2),
    )
    assert fault_script([]) == FaultScript()


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (
            {"kind": "melt", "start_s": 0, "duration_s": 1},
            "fault 2 has the kind 'melt': use unplug",
        ),
        ({"start_s": 0, "duration_s": 1}, "fault 2 has the kind None"),
        ({"kind": "drop", "start_s": 0}, "needs the number duration_s: give it in seconds"),
        ({"kind": "drop", "start_s": "0", "duration_s": 1}, "needs the number start_s"),
        ({"kind": "drop", "start_s": True, "duration_s": 1}, "needs the number start_s"),
        ({"kind": "drop", "start_s": 0, "duration_s": 1, "end_s": 2}, "unknown key 'end_s'"),
        ({"kind": "drop", "start_s": 0, "duration_s": 1, "delay_s": 2}, "unknown key 'delay_s'"),
        ({"kind": "drop", "start_s": -1, "duration_s": 1}, "start_s must not be negative"),
        ({"kind": "drop", "start_s": 0, "duration_s": 0}, "duration_s must be positive"),
        ({"kind": "drop", "start_s": math.nan, "duration_s": 1}, "start_s must not be negative"),
        ({"kind": "delay", "start_s": 0, "duration_s": 1, "delay_s": -1}, "delay_s must not be"),
    ],
)
def test_wrong_tables_are_refused_with_their_number(entry, message):
    good = {"kind": "freeze", "start_s": 0, "duration_s": 1}
    with pytest.raises(ConfigurationError) as caught:
        fault_script([good, entry])
    assert message in str(caught.value)
    assert str(caught.value).startswith("fault 2")
