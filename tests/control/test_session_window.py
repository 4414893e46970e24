"""A session whose window is lost: dark at once, told, and shown again by itself."""

import os
import signal
import time
from functools import partial

import numpy as np
import pytest

from drivers.clock import Clock
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings
from navapp.control.states import DeviceHealth, EventLevel
from tests.control.fakes import HEIGHT, WIDTH, Bench, navigating, wait_for
from tests.many import few_of
from tests.x_servers import seen, xvfb

# Pictures last for a minute here: only the loss itself can darken, on however busy a machine.
DARK_S = 5.0


class SeenWindow(WindowDisplay):
    """A window and the screen that it is on."""

    def __init__(self, server: str, clock: Clock, width: int, height: int) -> None:
        super().__init__(clock, WindowSettings("", width, height))
        self._server = server

    def visible_image(self) -> np.ndarray:
        return seen(self._server, 0, 0, WIDTH, HEIGHT)


@pytest.mark.parametrize("blow", few_of([signal.SIGKILL, signal.SIGSTOP]))
def test_a_window_that_dies_or_freezes_is_dark_told_and_opened_again(monkeypatch, blow) -> None:
    with xvfb(WIDTH, HEIGHT) as server:
        monkeypatch.setenv("DISPLAY", server)
        # No picture expires by itself here.
        bench = Bench(overlay_valid_ms=60_000.0, make_display=partial(SeenWindow, server))
        try:
            navigating(bench)
            bench.until(lambda: bench.shows_guides, 10.0)
            begin_s = time.monotonic()
            os.kill(bench.display.process.pid, blow)
            wait_for(lambda: bench.is_dark, "darkness")
            assert time.monotonic() - begin_s < DARK_S
            bench.until(lambda: bench.line("display").health is DeviceHealth.TROUBLE, 5.0)
            assert "the window is gone" in bench.line("display").detail
            assert bench.state == "navigating"
            alarms = [e.text for e in bench.events if e.level is EventLevel.ALARM]
            assert ["the window is gone" in text for text in alarms] == [True]
            assert bench.is_dark
            bench.until(lambda: bench.shows_guides, 20.0)
            assert bench.line("display").health is DeviceHealth.OK
        finally:
            bench.controller.close()
        wait_for(lambda: bench.is_dark, "the end")
