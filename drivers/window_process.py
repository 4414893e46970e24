"""Starts, watches and ends the window's process, from the application's side."""

import contextlib
import json
import os
import select
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from typing import IO, cast

from drivers.child_python import make_child_environment
from drivers.window_memory import BEAT_S, HANG_LIMIT_NS, Field, WindowMemory
from navapp.errors import DeviceError, DeviceLost, DeviceNotFound, DeviceTimeout, WrongDevice

_START_S = 15.0
_END_S = 1.0
_ERRORS = {kind.__name__: kind for kind in (DeviceError, DeviceNotFound, WrongDevice)}


@dataclass(frozen=True, slots=True)
class WindowSettings:
    """Output, size, flips and kind of a window."""

    output: str  # name of the monitor or projector as SDL tells it; empty: the only one
    # width, height: of the output, or of a framed window's pictures, px.
    width: int
    height: int
    # flips_horizontally, flips_vertically: what the window does to every picture.
    flips_horizontally: bool = False
    flips_vertically: bool = False
    is_framed: bool = False  # can be moved and resized, on any output


class WindowProcess:
    """A running window, black at first.

    A thread tells it every 50 ms that the application lives, and kills it when it hangs: the X
    server then takes the window away.

    Attributes:
        memory: what both share.
        output: name of the monitor or projector that it covers.

    Raises:
        DeviceNotFound, WrongDevice, DeviceError: as the window says.
        DeviceTimeout: it says nothing.
    """

    def __init__(self, settings: WindowSettings) -> None:
        with contextlib.ExitStack() as undo:
            descriptor = os.memfd_create("navapp-window")
            undo.callback(os.close, descriptor)
            woken, self._wake = os.pipe()
            os.set_blocking(self._wake, False)
            undo.callback(os.close, self._wake)
            try:
                self._process = _start(settings, descriptor, woken)
            finally:
                os.close(woken)
            undo.callback(_end, self._process)
            self.output = _await_opening(self._process)
            self.memory = WindowMemory(descriptor, settings.width, settings.height)
            os.close(descriptor)
            undo.pop_all()
        self._wake_lock, self._is_closed = threading.Lock(), False
        self._stopping = threading.Event()
        self._guard = threading.Thread(target=self._watch, name="window-guard", daemon=True)
        self._guard.start()

    @property
    def is_alive(self) -> bool:
        """Whether the window's process runs."""
        return self._process.poll() is None

    @property
    def pid(self) -> int:
        """Of the window's process."""
        return self._process.pid

    def wake(self) -> None:
        """Make it look at the memory now; a pipe that is full does so already."""
        with self._wake_lock, contextlib.suppress(OSError):
            if not self._is_closed:
                os.write(self._wake, b"!")

    def close(self) -> None:
        """Black, then end it, by force when it does not obey."""
        self._stopping.set()
        self._guard.join()
        self.memory.fields[Field.QUIT] = 1
        self.wake()
        _end(self._process)
        # The number of a closed descriptor soon belongs to another file.
        with self._wake_lock:
            self._is_closed = True
            os.close(self._wake)
        self.memory.close()

    def _watch(self) -> None:
        fields = self.memory.fields
        while not self._stopping.wait(BEAT_S):
            now_ns = time.monotonic_ns()
            fields[Field.APPLICATION_BEAT_NS] = now_ns
            if now_ns - fields[Field.WINDOW_BEAT_NS] > HANG_LIMIT_NS:
                self._process.kill()


def _start(settings: WindowSettings, descriptor: int, woken: int) -> "subprocess.Popen[bytes]":
    command = [sys.executable, "-P", "-m", "drivers.window_child"]
    numbers = (settings.width, settings.height)
    return subprocess.Popen(
        [
            *command,
            *(str(descriptor), str(woken), settings.output, *map(str, numbers)),
            *(["framed"] if settings.is_framed else []),
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        pass_fds=(descriptor, woken),
        env=make_child_environment(),
    )


def _await_opening(process: "subprocess.Popen[bytes]") -> str:
    """The name of the output that it covers, when the window stands."""
    answers = cast("IO[bytes]", process.stdout)
    ready, _, _ = select.select([answers], [], [], _START_S)
    if not ready:
        raise DeviceTimeout(f"the display's window did not open within {_START_S:.0f} s")
    line = answers.readline()
    try:
        answer: dict[str, str] = json.loads(line)
    except ValueError as error:
        raise DeviceLost(
            "the display's window ended while it was opened",
            remedy="see whether pygame-ce is installed, with navapp doctor",
        ) from error
    if "error" in answer:
        raise _ERRORS[answer["error"]](
            answer["problem"], subject="display", remedy=answer["remedy"]
        )
    return answer["output"]


def _end(process: "subprocess.Popen[bytes]") -> None:
    """Wait a moment for its own end, then force it."""
    try:
        process.wait(_END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    cast("IO[bytes]", process.stdout).close()
