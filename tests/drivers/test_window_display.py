"""The window on X servers without a monitor, judged by screenshots."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import mss
import numpy as np
import pytest

from drivers.clock import ManualClock, SystemClock
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings
from navapp.errors import DeviceLost, DeviceNotFound, WrongDevice
from tests.drivers.window_application import application
from tests.x_servers import shot, two_monitors, xvfb

pytestmark = pytest.mark.waits

WIDTH, HEIGHT = 320, 200
MINUTE_NS = 60 * 10**9
# docs/devices.md states the first; a busy machine is granted the second on top of every time.
HANG_S, GRACE_S = 1.0, 1.5


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with xvfb(WIDTH, HEIGHT) as display:
        yield display


@pytest.fixture
def screen(server: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[mss.MSS]:
    """An open eye on the server that windows are opened on."""
    monkeypatch.setenv("DISPLAY", server)
    with mss.MSS(display=server) as eye:
        yield eye


@contextmanager
def window(**settings: object) -> Iterator[WindowDisplay]:
    known = {"output": "", "width": WIDTH, "height": HEIGHT}
    display = WindowDisplay(SystemClock(), WindowSettings(**{**known, **settings}))  # type: ignore[arg-type]
    try:
        display.open()
        yield display
    finally:
        display.close()


def noise(width: int, height: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(1, 256, (height, width, 3), np.uint8)


# Left, top, width, height of a screen.
Part = tuple[int, int, int, int]
WHOLE: Part = (0, 0, WIDTH, HEIGHT)


def look(screen: mss.MSS, part: Part = WHOLE) -> np.ndarray:
    return shot(screen, *part)


def seconds_until(
    screen: mss.MSS,
    is_reached: Callable[[np.ndarray], bool],
    limit_s: float,
    part: Part = WHOLE,
) -> float:
    """How long it takes until all of that part is so."""
    begin_s = time.monotonic()
    while not is_reached(look(screen, part)):
        assert time.monotonic() - begin_s < limit_s, "the screen is not as it must be in time"
        time.sleep(0.005)  # without a pause the server forgets to clear up after the dead
    return time.monotonic() - begin_s


def is_black(picture: np.ndarray) -> bool:
    return not picture.any()


@pytest.mark.parametrize("flips_horizontally", [False, True])
@pytest.mark.parametrize("flips_vertically", [False, True])
def test_every_pixel_is_where_it_belongs(screen, flips_horizontally, flips_vertically) -> None:
    image = noise(WIDTH, HEIGHT)
    expected = image[:, ::-1] if flips_horizontally else image
    expected = expected[::-1] if flips_vertically else expected
    with window(
        flips_horizontally=flips_horizontally, flips_vertically=flips_vertically
    ) as display:
        display.show(image, time.monotonic_ns() + MINUTE_NS)
        seconds_until(screen, lambda picture: np.array_equal(picture, expected), 5.0)


def test_pictures_that_come_faster_than_they_are_shown_are_never_mixed(screen) -> None:
    flat = [np.full((HEIGHT, WIDTH, 3), grey, np.uint8) for grey in (60, 90, 120, 150, 180)]
    with window() as display:
        until_ns = time.monotonic_ns() + MINUTE_NS
        for k in range(400):
            display.show(flat[k % 5], until_ns)
            if k % 10 == 0:
                assert np.ptp(look(screen)) == 0
        seconds_until(screen, lambda picture: bool((picture == 180).all()), 5.0)


def test_another_window_in_front_leaves_no_hole(screen) -> None:
    image = noise(WIDTH, HEIGHT)
    with window() as display:
        display.show(image, time.monotonic_ns() + MINUTE_NS)
        seconds_until(screen, lambda picture: np.array_equal(picture, image), 5.0)
        with window():
            seconds_until(screen, is_black, 5.0)
        seconds_until(screen, lambda picture: np.array_equal(picture, image), 5.0)


def test_a_clock_that_stands_keeps_no_picture_alive(screen) -> None:
    clock = ManualClock(5)
    display = WindowDisplay(clock, WindowSettings("", WIDTH, HEIGHT))
    display.open()
    try:
        display.show(noise(WIDTH, HEIGHT), clock.now_ns() + 10**9)
        seconds_until(screen, lambda picture: not is_black(picture), 5.0)
        assert seconds_until(screen, is_black, 5.0) < 1.0 + GRACE_S
    finally:
        display.close()


def is_white(picture: np.ndarray) -> bool:
    return bool((picture == 255).all())


@pytest.mark.parametrize(
    ("blow", "limit_s"),
    [(signal.SIGKILL, 0.05), (signal.SIGTERM, 0.05), (signal.SIGSTOP, HANG_S + 0.05)],
)
def test_black_when_the_application_dies_or_hangs(screen, blow, limit_s) -> None:
    with application(WIDTH, HEIGHT) as (own, child):
        seconds_until(screen, is_white, 10.0)
        own.send_signal(blow)
        assert seconds_until(screen, is_black, 10.0) < limit_s + GRACE_S
        if blow is not signal.SIGSTOP:
            child.wait(5.0)


def test_a_hung_application_that_wakes_up_does_not_show_its_old_picture(screen) -> None:
    with application(WIDTH, HEIGHT) as (own, _):
        seconds_until(screen, is_white, 10.0)
        own.suspend()
        seconds_until(screen, is_black, 10.0)
        own.resume()
        time.sleep(0.5)
        assert is_black(look(screen))


@pytest.mark.parametrize(
    ("blow", "limit_s"), [(signal.SIGKILL, 0.05), (signal.SIGSTOP, HANG_S + 0.1)]
)
def test_black_when_the_window_dies_or_hangs_and_it_can_be_opened_again(
    screen, blow, limit_s
) -> None:
    image = noise(WIDTH, HEIGHT)
    with window() as display:
        display.show(image, time.monotonic_ns() + MINUTE_NS)
        seconds_until(screen, lambda picture: np.array_equal(picture, image), 5.0)
        assert display.process is not None
        os.kill(display.process.pid, blow)
        assert seconds_until(screen, is_black, 10.0) < limit_s + GRACE_S
        # Its screen is gone before the process itself is, on a busy machine by more than a moment.
        end_s = time.monotonic() + 5.0
        while display.process.is_alive and time.monotonic() < end_s:
            time.sleep(0.01)
        with pytest.raises(DeviceLost, match="the window is gone"):
            display.show(image, time.monotonic_ns() + MINUTE_NS)
        display.blank()
        display.open()
        display.show(image, time.monotonic_ns() + MINUTE_NS)
        seconds_until(screen, lambda picture: np.array_equal(picture, image), 5.0)


def test_interrupting_the_terminal_is_for_the_application_to_handle(screen) -> None:
    with window() as display:
        assert display.process is not None
        os.kill(display.process.pid, signal.SIGINT)
        time.sleep(0.2)
        assert display.process.is_alive


@pytest.mark.parametrize("driver", ["dummy", "offscreen"])
def test_invisible_drivers_are_refused(screen, driver, monkeypatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", driver)
    with pytest.raises(DeviceNotFound, match=f"no X11 screen.*'{driver}'"), window():
        pass


def test_no_server_is_refused(monkeypatch) -> None:
    monkeypatch.setenv("DISPLAY", ":31999")
    with pytest.raises(DeviceNotFound, match=r"no X11 screen.*DISPLAY"), window():
        pass


def test_another_size_or_output_is_refused_by_name(screen) -> None:
    other_size = pytest.raises(WrongDevice, match=r"\(320x200\) has another size than 640x400")
    with other_size, window(width=640, height=400):
        pass
    other_name = pytest.raises(DeviceNotFound, match=r"no output 'HDMI-7'.*\(320x200\)")
    with other_name, window(output="HDMI-7"):
        pass


def test_two_monitors(tmp_path, monkeypatch) -> None:
    with two_monitors(tmp_path) as server:
        monkeypatch.setenv("DISPLAY", server)
        with pytest.raises(DeviceNotFound, match=r"several outputs.*DUMMY0 .*DUMMY1"), window():
            pass
        wide, small = noise(960, 540, 1), noise(800, 600, 2)
        on_first, on_second = (0, 0, 960, 540), (960, 0, 800, 600)
        left = window(output="DUMMY0", width=960, height=540)
        right = window(output="DUMMY1", width=800, height=600)
        with left as first, right as second, mss.MSS(display=server) as eye:
            first.show(wide, time.monotonic_ns() + MINUTE_NS)
            second.show(small, time.monotonic_ns() + MINUTE_NS)
            seconds_until(eye, lambda p: np.array_equal(p, wide), 5.0, on_first)
            seconds_until(eye, lambda p: np.array_equal(p, small), 5.0, on_second)
            first.blank()
            seconds_until(eye, is_black, 5.0, on_first)
            assert np.array_equal(look(eye, on_second), small)


def test_a_framed_window_scales_the_picture_and_is_dark_without_one(screen) -> None:
    image = np.zeros((4 * HEIGHT, 4 * WIDTH, 3), np.uint8)
    image[: 2 * HEIGHT] = (10, 200, 90)

    def is_lit(seen: np.ndarray) -> np.ndarray:
        # Scaling rounds by some levels.
        return (np.abs(seen.astype(int) - (10, 200, 90)) < 12).all(axis=2)

    with window(width=4 * WIDTH, height=4 * HEIGHT, is_framed=True) as display:
        display.show(image, SystemClock().now_ns() + MINUTE_NS)
        seconds_until(screen, lambda seen: bool(is_lit(seen).any()), 5.0)
        rows, columns = np.nonzero(is_lit(look(screen)))
        width, height = columns.max() + 1 - columns.min(), 2 * (rows.max() + 1 - rows.min())
        assert width / height == pytest.approx(WIDTH / HEIGHT, rel=0.03)
        assert 0.8 * WIDTH < width <= 0.91 * WIDTH
        display.blank()
        seconds_until(screen, is_black, 2.0)
        display.show(image, SystemClock().now_ns() + 200_000_000)
        seconds_until(screen, lambda seen: bool(is_lit(seen).any()), 5.0)
        seconds_until(screen, is_black, 2.0)
