"""Light that is late, and what cameras see of it."""

import numpy as np
import pytest

from drivers.clock import ManualClock
from navapp.errors import DeviceLost
from sim_devices.lit_display import DisplayInView, LitDisplay
from tests.sim_devices.plain_world import plain_rig

MS = 1_000_000
WHITE = np.full((36, 64, 3), 255, np.uint8)


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


def lit(clock: ManualClock, delay_ms: int = 40, refresh_hz: float = 100.0) -> LitDisplay:
    display = LitDisplay(clock, 64, 36, delay_ns=delay_ms * MS, refresh_hz=refresh_hz)
    display.open()
    return display


def light(display: LitDisplay, from_ms: float, until_ms: float) -> float:
    return display.mean_light(round(from_ms * MS), round(until_ms * MS))


def test_light_comes_with_the_first_refresh_after_the_delay(clock: ManualClock) -> None:
    display = lit(clock)
    clock.wait_until_ns(103 * MS)
    display.show(WHITE, 10_000 * MS)
    assert light(display, 140.0, 149.9) == 0.0
    assert light(display, 150.1, 160.0) == 1.0
    assert light(display, 146.0, 154.0) == pytest.approx(0.5)


def test_it_is_as_bright_as_its_picture_is_on_average(clock: ManualClock) -> None:
    display = lit(clock)
    half = WHITE.copy()
    half[:, :32] = 0
    display.show(half, 10_000 * MS)
    assert light(display, 100.0, 108.0) == pytest.approx(0.5)


def test_expiry_blank_and_closing_darken_it_as_late(clock: ManualClock) -> None:
    display = lit(clock)
    display.show(WHITE, 100 * MS)
    assert light(display, 130.0, 139.9) == 1.0
    assert light(display, 140.1, 200.0) == 0.0
    for end in (display.blank, display.close):
        display.show(WHITE, clock.now_ns() + 1_000 * MS)
        clock.advance_ns(100 * MS)
        end()
        now_ms = clock.now_ns() / MS
        assert light(display, now_ms + 30.0, now_ms + 39.9) == 1.0
        assert light(display, now_ms + 40.1, now_ms + 60.0) == 0.0
        clock.advance_ns(100 * MS)
    with pytest.raises(DeviceLost):
        display.show(WHITE, clock.now_ns() + MS)


def test_what_is_expired_when_it_is_shown_gives_no_light(clock: ManualClock) -> None:
    display = lit(clock)
    clock.wait_until_ns(50 * MS)
    display.show(WHITE, 40 * MS)
    assert light(display, 0.0, 500.0) == 0.0


def test_cameras_see_the_light_of_their_exposure_and_the_wall_around_it(clock) -> None:
    display = lit(clock)
    view = DisplayInView(display, clock, 8 * MS, plain_rig())
    view.begin(1_000 * MS)
    clock.wait_until_ns(1_000 * MS)
    display.show(WHITE, 10_000 * MS)
    dark, half, full = (view.render("left", time_ms * MS)[24, 32, 0] for time_ms in (20, 40, 60))
    assert half == pytest.approx(0.5 * (dark + full), abs=1e-6)
    assert full > 5.0 * dark
    for eye in ("left", "right"):
        picture = view.render(eye, 60 * MS)
        assert picture.shape == (48, 64, 3)
        assert picture[0, 0, 0] == pytest.approx(dark)
        assert 0.1 < np.mean(picture > 0.5 * full) < 0.3
    assert view.render("left", 60 * MS, 0.5).shape == (24, 32, 3)


def test_a_picture_waits_until_nothing_can_change_it_any_more(clock: ManualClock) -> None:
    view = DisplayInView(lit(clock), clock, 8 * MS, plain_rig())
    view.render("left", 100 * MS)
    assert clock.now_ns() == 64 * MS
