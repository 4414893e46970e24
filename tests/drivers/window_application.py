"""An application that shows one white picture for a minute, in a process that a test may kill.

`python -m tests.drivers.window_application WIDTH HEIGHT`; prints the window's process number as
soon as the picture was given away, then sleeps.
"""

import sys
import time

import numpy as np

from drivers.clock import SystemClock
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings

if __name__ == "__main__":
    width, height = map(int, sys.argv[1:])
    display = WindowDisplay(SystemClock(), WindowSettings("", width, height))
    display.open()
    white = np.full((height, width, 3), 255, np.uint8)
    display.show(white, time.monotonic_ns() + 60 * 10**9)
    assert display.process is not None
    print(display.process.pid, flush=True)
    time.sleep(60.0)
