"""The cross on a window of an X server without a monitor, judged by screenshots."""

import time

import mss
import numpy as np
import pytest

from drivers.clock import SystemClock
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings
from navapp.control.mirror_alignment.shown_cross import ShownCross
from tests.x_servers import shot, xvfb

WIDTH, HEIGHT = 320, 200


def wait_for(seen, limit_s: float = 5.0) -> None:
    end_s = time.monotonic() + limit_s
    while not seen():
        assert time.monotonic() < end_s
        time.sleep(0.02)


def test_the_cross_is_seen_pixel_for_pixel_and_goes_out(monkeypatch: pytest.MonkeyPatch) -> None:
    with xvfb(WIDTH, HEIGHT) as server:
        monkeypatch.setenv("DISPLAY", server)
        clock = SystemClock()
        display = WindowDisplay(clock, WindowSettings("", WIDTH, HEIGHT))
        display.open()
        cross = ShownCross(display, clock, valid_ms=60_000.0)
        with mss.MSS(display=server) as eye:

            def middle() -> tuple[float, float]:
                rows, columns = np.nonzero(shot(eye, 0, 0, WIDTH, HEIGHT)[:, :, 1])
                if len(rows) == 0:
                    return (-1.0, -1.0)
                return 0.5 * (columns.min() + columns.max()), 0.5 * (rows.min() + rows.max())

            cross.put((100, 80))
            cross.renew()
            wait_for(lambda: middle() == (100.0, 80.0))
            cross.nudge(10, 3, (True, False))
            cross.renew()
            wait_for(lambda: middle() == (90.0, 83.0))
            cross.put(None)
            wait_for(lambda: middle() == (-1.0, -1.0))
        cross.close()
        display.close()
