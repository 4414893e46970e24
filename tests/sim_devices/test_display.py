import numpy as np
import pytest

from drivers.clock import ManualClock
from navapp.errors import DeviceLost
from sim_devices.display import SimulatedDisplay


@pytest.fixture
def clock():
    return ManualClock(1_000)


def opened(clock: ManualClock, **flips: bool) -> SimulatedDisplay:
    display = SimulatedDisplay(clock, 32, 16, **flips)
    display.open()
    return display


def lit() -> np.ndarray:
    return np.arange(16 * 32 * 3, dtype=np.uint8).reshape(16, 32, 3)


def test_picture_is_visible_until_the_moment_it_expires(clock):
    display = opened(clock)
    display.show(lit(), 2_000)
    clock.wait_until_ns(1_999)
    assert np.array_equal(display.visible_image(), lit())
    clock.wait_until_ns(2_000)
    assert not display.visible_image().any()


def test_only_pictures_that_became_visible_are_counted(clock):
    display = opened(clock)
    display.show(lit(), 1_000)
    display.show(lit(), 1_001)
    assert display.n_shown == 1


def test_picture_that_comes_too_late_does_not_darken_a_valid_one(clock):
    display = opened(clock)
    display.show(lit(), 2_000)
    display.show(lit() + 1, 500)
    assert np.array_equal(display.visible_image(), lit())


@pytest.mark.parametrize("horizontally", [False, True])
@pytest.mark.parametrize("vertically", [False, True])
def test_flips_of_its_info_are_applied(clock, horizontally, vertically):
    display = opened(clock, flips_horizontally=horizontally, flips_vertically=vertically)
    display.show(lit(), 2_000)
    expected = lit()[:: -1 if vertically else 1, :: -1 if horizontally else 1]
    assert np.array_equal(display.visible_image(), expected)
    info = display.info
    assert (info.flips_horizontally, info.flips_vertically) == (horizontally, vertically)


def test_it_says_that_it_is_simulated():
    info = SimulatedDisplay(ManualClock(), 32, 16).info
    assert info.is_simulated
    assert info.name.startswith("sim:")


def test_closed_display_says_what_to_do(clock):
    with pytest.raises(DeviceLost, match="is not open: open it"):
        SimulatedDisplay(clock, 32, 16).show(lit(), 2_000)
