"""How soon the window shows, and how soon it is dark, on an X server without a monitor.

usage: python -m tests.bench.window_times [--size 1280x720] [--rounds 20]

Looks at one pixel every 2 ms; the times are those of the wall.
"""

import argparse
import os
import signal
import time
from collections.abc import Callable

import mss
import numpy as np
import psutil

from drivers.clock import SystemClock
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings
from tests.drivers.window_application import application
from tests.x_servers import shot, xvfb

_NS = 10**9
_VALIDITY_S = 0.5
# A server that is asked without a pause forgets to clear up after clients that died.
_PAUSE_S = 0.002


def main() -> None:
    """Print one line an event: median and slowest."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--rounds", type=int, default=20)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    print(f"| {options.size}, {options.rounds} rounds | median ms | slowest ms |\n|---|---|---|")
    with xvfb(width, height) as server:
        os.environ["DISPLAY"] = server
        with mss.MSS(display=server) as eye:
            for name, measured in _MEASUREMENTS.items():
                times_ms = [1e3 * measured(eye, width, height) for _ in range(options.rounds)]
                print(f"| {name} | {np.median(times_ms):.1f} | {max(times_ms):.1f} |", flush=True)


def opening_s(eye: mss.MSS, width: int, height: int) -> float:
    """Until a black window stands."""
    display = WindowDisplay(SystemClock(), WindowSettings("", width, height))
    begin_s = time.monotonic()
    display.open()
    taken_s = time.monotonic() - begin_s
    display.close()
    return taken_s


def _shown(
    measure: Callable[[mss.MSS, WindowDisplay], float],
) -> Callable[..., float]:
    """A measurement on a window that shows white."""

    def measured(eye: mss.MSS, width: int, height: int) -> float:
        display = WindowDisplay(SystemClock(), WindowSettings("", width, height))
        display.open()
        display.show(_white(display), time.monotonic_ns() + 60 * _NS)
        until(eye, is_lit=True)
        taken_s = measure(eye, display)
        display.close()
        return taken_s

    return measured


def calling_s(eye: mss.MSS, display: WindowDisplay) -> float:
    """What `show` takes."""
    begin_s = time.monotonic()
    display.show(_white(display), time.monotonic_ns() + 60 * _NS)
    return time.monotonic() - begin_s


def showing_s(eye: mss.MSS, display: WindowDisplay) -> float:
    """From `show` until the picture is there."""
    display.blank()
    until(eye, is_lit=False)
    begin_s = time.monotonic()
    display.show(_white(display), time.monotonic_ns() + 60 * _NS)
    until(eye, is_lit=True)
    return time.monotonic() - begin_s


def blanking_s(eye: mss.MSS, display: WindowDisplay) -> float:
    """From `blank` until it is dark."""
    begin_s = time.monotonic()
    display.blank()
    until(eye, is_lit=False)
    return time.monotonic() - begin_s


def expiring_s(eye: mss.MSS, display: WindowDisplay) -> float:
    """From the picture's expiry until it is dark."""
    expiry_s = time.monotonic() + _VALIDITY_S
    display.show(_white(display), round(expiry_s * _NS))
    until(eye, is_lit=False)
    return time.monotonic() - expiry_s


def window_killed_s(eye: mss.MSS, display: WindowDisplay) -> float:
    """From the end of the window's process until it is dark."""
    return _window_struck_s(eye, display, signal.SIGKILL)


def window_stopped_s(eye: mss.MSS, display: WindowDisplay) -> float:
    """From the window's process standing still until it is dark."""
    return _window_struck_s(eye, display, signal.SIGSTOP)


def _window_struck_s(eye: mss.MSS, display: WindowDisplay, blow: signal.Signals) -> float:
    assert display.process is not None
    begin_s = time.monotonic()
    os.kill(display.process.pid, blow)
    until(eye, is_lit=False)
    return time.monotonic() - begin_s


def _application_struck(blow: signal.Signals) -> Callable[[mss.MSS, int, int], float]:
    def measured(eye: mss.MSS, width: int, height: int) -> float:
        with application(width, height) as (own, child):
            until(eye, is_lit=True)
            begin_s = time.monotonic()
            own.send_signal(blow)
            until(eye, is_lit=False)
            taken_s = time.monotonic() - begin_s
            own.kill()
            psutil.wait_procs([child], timeout=5.0)
            return taken_s

    return measured


def until(eye: mss.MSS, *, is_lit: bool) -> None:
    """Return when a pixel in the middle is lit, or dark."""
    monitor = eye.monitors[0]
    left, top = monitor["width"] // 2, monitor["height"] // 2
    while shot(eye, left, top, 1, 1).any() != is_lit:
        time.sleep(_PAUSE_S)


def _white(display: WindowDisplay) -> np.ndarray:
    return np.full((display.info.height, display.info.width, 3), 255, np.uint8)


_MEASUREMENTS: dict[str, Callable[[mss.MSS, int, int], float]] = {
    "`open` to black window": opening_s,
    "`show`, the call": _shown(calling_s),
    "`show` to seen": _shown(showing_s),
    "`blank` to dark": _shown(blanking_s),
    "expiry to dark": _shown(expiring_s),
    "application killed (SIGKILL) to dark": _application_struck(signal.SIGKILL),
    "application stopped (SIGSTOP) to dark, picture valid for a minute": _application_struck(
        signal.SIGSTOP
    ),
    "window's process killed to dark": _shown(window_killed_s),
    "window's process stopped to dark": _shown(window_stopped_s),
}


if __name__ == "__main__":
    main()
