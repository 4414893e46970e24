"""What the devices panel says of the rig."""

import pytest

from navapp.control.device_lines import rig_line, with_remedy
from navapp.control.length_check import Finding, LengthCheck
from navapp.control.states import DeviceHealth, DeviceLine

S = 1_000_000_000


def check(finding: Finding, n_looks: int = 4) -> LengthCheck:
    return LengthCheck(2 * S, 1.0004, 0.0001, n_looks, finding)


@pytest.mark.parametrize(
    ("finding", "health"),
    [
        (Finding.WITHIN, DeviceHealth.OK),
        (Finding.DOUBTFUL, DeviceHealth.TROUBLE),
        (Finding.OFF, DeviceHealth.TROUBLE),
        (Finding.NOT_JUDGED, DeviceHealth.UNKNOWN),
    ],
)
def test_only_a_length_that_is_right_is_good_news(finding: Finding, health: DeviceHealth) -> None:
    assert rig_line("rig", "", check(finding), 9 * S).health is health


def test_a_rig_that_was_never_measured_is_no_good_news() -> None:
    line = rig_line("rig", "", None, 9 * S)
    assert (line.health, line.detail) == (DeviceHealth.UNKNOWN, "not checked: show the board")
    few = check(Finding.NOT_JUDGED, 2)
    line = rig_line("rig", "", few, 9 * S, few)
    assert (line.health, line.detail) == (
        DeviceHealth.UNKNOWN,
        "2 of 3 looks at the board, 7 s ago",
    )


def test_the_last_word_stays_beside_looks_that_do_not_say_one_yet() -> None:
    line = rig_line("rig", "", check(Finding.WITHIN), 9 * S, check(Finding.NOT_JUDGED, 1))
    assert line.health is DeviceHealth.OK
    assert line.detail == (
        "100 mm on the board are measured as 100.04 +- 0.01 mm, 7 s ago; "
        "now 1 of 3 looks at the board"
    )
    moved = rig_line("rig", "", check(Finding.DOUBTFUL), 9 * S, check(Finding.NOT_JUDGED))
    assert moved.health is DeviceHealth.TROUBLE
    assert moved.detail.endswith("; now the board is not held still")


def test_a_rig_that_moved_is_told_before_all_else() -> None:
    line = rig_line("rig", "rig moved", check(Finding.WITHIN), 9 * S)
    assert (line.health, line.detail) == (DeviceHealth.TROUBLE, "rig moved")


KINDS = ("camera", "display", "projector", "mirror", "rig", "recording")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("health", DeviceHealth)
def test_every_device_in_trouble_says_what_to_do_and_no_other(
    kind: str, health: DeviceHealth
) -> None:
    is_failed = health in (DeviceHealth.TROUBLE, DeviceHealth.LOST)
    assert bool(with_remedy(DeviceLine(kind, "x", health)).remedy) is is_failed


def test_what_a_device_says_itself_comes_first() -> None:
    line = DeviceLine("projector", "x", DeviceHealth.TROUBLE, "standby", "p switches it on")
    assert with_remedy(line) == line
