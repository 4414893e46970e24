"""X servers without a monitor, and eyes on them."""

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mss
import numpy as np
import pytest
from numpy.typing import NDArray

_DUMMY_DRIVERS = Path("/usr/lib/xorg/modules/drivers/dummy_drv.so")
_DUMMY_CONFIGURATION = """
Section "ServerFlags"
    Option "AutoAddDevices" "false"
    Option "DontVTSwitch" "true"
EndSection
Section "Device"
    Identifier "card"
    Driver "dummy"
    VideoRam 256000
EndSection
Section "Screen"
    Identifier "screen"
    Device "card"
    DefaultDepth 24
    SubSection "Display"
        Depth 24
        Virtual 3200 1080
    EndSubSection
EndSection
"""


@contextmanager
def xvfb(width: int, height: int) -> Iterator[str]:
    """One screen of that size; its DISPLAY. Skips where Xvfb is missing."""
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb (make system-deps)")
    screen = ["-screen", "0", f"{width}x{height}x24"]
    with _server(["Xvfb", "-noreset", "-nolisten", "tcp", *screen]) as display:
        yield display


@contextmanager
def two_monitors(folder: Path) -> Iterator[str]:
    """DUMMY0 of 960x540 and DUMMY1 of 800x600 to its right; skips where they are missing."""
    if os.geteuid() != 0 or not _DUMMY_DRIVERS.exists() or shutil.which("xrandr") is None:
        pytest.skip("no Xorg with the dummy driver, no xrandr (make system-deps), or not root")
    configuration = folder / "xorg.conf"
    configuration.write_text(_DUMMY_CONFIGURATION)
    files = ["-config", str(configuration), "-logfile", str(folder / "xorg.log")]
    with _server(["Xorg", "-noreset", "-novtswitch", "-nolisten", "tcp", *files]) as display:
        _xrandr(display, "--output", "DUMMY0", "--mode", "960x540", "--pos", "0x0")
        _xrandr(display, "--addmode", "DUMMY1", "800x600")
        _xrandr(display, "--output", "DUMMY1", "--mode", "800x600", "--pos", "960x0")
        _xrandr(display)  # only a question makes the server notice that DUMMY1 is connected now
        yield display


def seen(display: str, left: int, top: int, width: int, height: int) -> NDArray[np.uint8]:
    """(height, width, 3) uint8 BGR that is on a part of the screen now."""
    with mss.MSS(display=display) as camera:
        return shot(camera, left, top, width, height)


def shot(camera: mss.MSS, left: int, top: int, width: int, height: int) -> NDArray[np.uint8]:
    """The same through a connection that is kept."""
    grabbed = camera.grab({"left": left, "top": top, "width": width, "height": height})
    return np.frombuffer(grabbed.bgra, np.uint8).reshape(height, width, 4)[..., :3].copy()


@contextmanager
def _server(command: list[str]) -> Iterator[str]:
    """Run an X server that chooses its own number."""
    read, write = os.pipe()
    server = subprocess.Popen(
        [*command, "-displayfd", str(write)],
        pass_fds=(write,),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    try:
        with os.fdopen(read) as numbers:
            number = numbers.readline().strip()
        assert number, f"{command[0]} did not start"
        yield f":{number}"
    finally:
        server.terminate()
        server.wait(20.0)


def _xrandr(display: str, *arguments: str) -> None:
    """As soon as the server answers: it does not know its outputs at once."""
    end_s = time.monotonic() + 20.0
    while True:
        done = subprocess.run(
            ["xrandr", "--display", display, *arguments], capture_output=True, check=False
        )
        if done.returncode == 0:
            return
        assert time.monotonic() < end_s, done.stderr
        time.sleep(0.2)
