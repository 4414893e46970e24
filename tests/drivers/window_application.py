"""An application that shows one white picture for a minute, in a process that a test may kill.

`python -m tests.drivers.window_application WIDTH HEIGHT` prints the window's process number as soon
as the picture was given away, then sleeps.
"""

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import psutil

from drivers.clock import SystemClock
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings


@contextmanager
def application(width: int, height: int) -> Iterator[tuple[psutil.Process, psutil.Process]]:
    """That application, and its window's process; both are ended."""
    command = [sys.executable, "-m", __name__, str(width), str(height)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as started:
        assert started.stdout is not None
        own = psutil.Process(started.pid)
        child = psutil.Process(int(started.stdout.readline()))
        try:
            yield own, child
        finally:
            for process in (own, child):
                if process.is_running():
                    process.kill()
            psutil.wait_procs([child], timeout=5.0)


def main(width: int, height: int) -> None:
    display = WindowDisplay(SystemClock(), WindowSettings("", width, height))
    display.open()
    white = np.full((height, width, 3), 255, np.uint8)
    display.show(white, time.monotonic_ns() + 60 * 10**9)
    assert display.process is not None
    print(display.process.pid, flush=True)
    time.sleep(60.0)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
