"""The delay of a real window on an X server without a monitor, seen by taking screenshots."""

import mss
import numpy as np
import pytest

from calibration.latency.acceptance import measure_accepted_latency
from calibration.latency.light_code import draw_pauses_ms
from drivers.clock import SystemClock
from drivers.frames import StereoFrame
from drivers.interfaces import CameraInfo
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings
from navapp.control.display_delay.code_player import CodePlayer
from navapp.control.display_delay.code_recording import record_code
from tests.x_servers import seen, shot, xvfb

pytestmark = pytest.mark.waits

WIDTH, HEIGHT = 320, 200
RATE_HZ = 60.0
# By which the right picture is stamped too early.
RIGHT_LATE_NS = 12_000_000


class ScreenCamera:
    """Both eyes are screenshots, the right one taken later; only the left one's time is told."""

    def __init__(self, clock: SystemClock, eye: mss.MSS) -> None:
        self._clock, self._eye, self._n = clock, eye, 0
        self._next_ns = clock.now_ns()
        self.info = CameraInfo("screen", "screen", False, False, WIDTH, HEIGHT)

    def read(self, timeout_s: float) -> StereoFrame:
        self._clock.wait_until_ns(self._next_ns)
        left, captured_ns = self._shot()
        self._clock.wait_until_ns(captured_ns + RIGHT_LATE_NS)
        right, right_ns = self._shot()
        # However late the second one was, it is stamped with the same error.
        skew_ns = right_ns - captured_ns - RIGHT_LATE_NS
        self._next_ns = max(self._next_ns + round(1e9 / RATE_HZ), self._clock.now_ns())
        self._n += 1
        return StereoFrame(left, right, captured_ns, self._clock.now_ns(), skew_ns, self._n, "")

    def _shot(self) -> tuple[np.ndarray, int]:
        before_ns = self._clock.now_ns()
        picture = shot(self._eye, 0, 0, WIDTH, HEIGHT)
        return picture, (before_ns + self._clock.now_ns()) // 2


@pytest.mark.release
@pytest.mark.slow
def test_a_window_is_seen_some_milliseconds_after_the_call(monkeypatch) -> None:
    clock = SystemClock()
    with xvfb(WIDTH, HEIGHT) as server:
        monkeypatch.setenv("DISPLAY", server)
        display = WindowDisplay(clock, WindowSettings("", WIDTH, HEIGHT))
        display.open()
        try:
            with mss.MSS(display=server) as eye:
                player = CodePlayer(display, clock, draw_pauses_ms(7.0, 0))
                recording = record_code(ScreenCamera(clock, eye), player, clock, lambda _: None)
            clock.wait_until_ns(clock.now_ns() + 200_000_000)
            assert not seen(server, 0, 0, WIDTH, HEIGHT).any()
        finally:
            display.close()
    # This screen has no refresh to wait for.
    found = measure_accepted_latency(recording.switches, recording.left, recording.right, 1000.0)
    assert 0.0 < found.delay.value_ms < 40.0
    assert found.late.value_ms == pytest.approx(RIGHT_LATE_NS * 1e-6, abs=3.0)
