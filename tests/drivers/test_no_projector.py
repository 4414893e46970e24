import pytest

from drivers.interfaces import PowerState, ProjectorStatus
from drivers.no_projector import NoProjector
from navapp.errors import UnsupportedControl


def test_it_says_that_it_is_absent():
    assert NoProjector().status() == ProjectorStatus(PowerState.ABSENT)


@pytest.mark.parametrize(
    ("command", "arguments"),
    [
        ("set_power", (True,)),
        ("set_source", ("30",)),
        ("set_mute", (True,)),
        ("set_flips", (True, False)),
    ],
)
def test_commands_are_refused_with_the_remedy(command, arguments):
    with pytest.raises(
        UnsupportedControl, match=r"no projector is configured.*under \[projector\]"
    ):
        getattr(NoProjector(), command)(*arguments, timeout_s=1.0)
