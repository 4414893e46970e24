"""What the operator's screen costs the tracker: its times with and without the screen, in turn.

usage: python -m tests.bench.screen_load [--pictures kitty|sixel|blocks] [--turns N]

Pictures of the simulated leg are made beforehand and played to and fro, fifteen a second. The
session runs all the time, as in `navapp run`; the screen is switched on and off, and the first two
seconds of each turn do not count. Its terminal
(160 x 48 characters of 6 x 13 px) is a process that takes everything and draws nothing.
"""

import argparse
import asyncio
import fcntl
import os
import pty
import select
import struct
import sys
import tempfile
import termios
import threading
import time
from contextlib import ExitStack
from dataclasses import replace
from itertools import chain, cycle
from pathlib import Path
from typing import TextIO

import numpy as np

from drivers.frames import StereoFrame
from drivers.interfaces import StereoCamera
from navapp.cli.diagnostics import Diagnostics
from navapp.cli.live_session import LiveSession, make_controller, prepare_session
from navapp.cli.main import _parser
from navapp.config import load
from navapp.control.commands import Accept, Register
from navapp.control.runner import SessionRunner
from navapp.control.states import SessionState
from navapp.devices import open_live
from navapp.ui.app import NavigationApp
from navapp.ui.pictures.blocks import CELL_PX, BlockEncoder
from navapp.ui.pictures.graphics import Graphics
from navapp.ui.pictures.kitty import KittyEncoder
from navapp.ui.pictures.sixel import SixelEncoder
from navapp.ui.terminal import own_terminal

_N_FRAMES, _RATE_HZ, _TURN_S, _WARM_S = 45, 15.0, 8.0, 2.0
_COLUMNS, _ROWS, _CELL_PX = 160, 48, (6, 13)


class PlayedCamera:
    """Plays frames that were made beforehand, in real time."""

    def __init__(self, camera: StereoCamera, frames: list[StereoFrame]) -> None:
        self.info = camera.info
        self._frames = cycle(chain(frames, reversed(frames)))
        self._n, self._due_s = 0, time.monotonic()

    def open(self) -> None:
        """It is."""

    def read(self, timeout_s: float) -> StereoFrame:
        """The next one when it is due; late ones are left out, as by every camera."""
        while self._due_s < time.monotonic() - 1.0 / _RATE_HZ:
            self._due_s += 1.0 / _RATE_HZ
            next(self._frames)
        time.sleep(max(0.0, self._due_s - time.monotonic()))
        self._due_s += 1.0 / _RATE_HZ
        now_ns = time.monotonic_ns()
        self._n += 1
        return replace(next(self._frames), captured_ns=now_ns, received_ns=now_ns, sequence=self._n)

    def set(self, control: str, value: float) -> float:
        raise NotImplementedError

    def close(self) -> None:
        """Nothing."""


def make_frames() -> list[StereoFrame]:
    """Of the breathing leg."""
    opened = open_live(load(None), is_headless=True)
    try:
        return [opened.devices.camera.read(5.0) for _ in range(_N_FRAMES)]
    finally:
        opened.devices.close()


def make_session(frames: list[StereoFrame]) -> LiveSession:
    """The simulated session with a camera that costs nothing."""
    options = _parser().parse_args(["run"])
    session = prepare_session(load(None), options, Diagnostics(options))
    devices = session.opened.devices
    devices.camera.close()
    played = replace(devices, camera=PlayedCamera(devices.camera, frames))
    return replace(session, opened=replace(session.opened, devices=played))


class Terminal:
    """A pseudo-terminal whose other end is read by a process; descriptors 0 and 1 are this end."""

    def __init__(self) -> None:
        self.master, slave = pty.openpty()
        size = struct.pack("4H", _ROWS, _COLUMNS, _COLUMNS * _CELL_PX[0], _ROWS * _CELL_PX[1])
        fcntl.ioctl(slave, termios.TIOCSWINSZ, size)
        self.pid = os.fork()
        if self.pid == 0:
            os.close(slave)
            drain(self.master)
            os._exit(0)
        os.close(self.master)
        for descriptor in (0, 1):
            os.dup2(slave, descriptor)
        os.close(slave)
        os.environ.update(TERM="xterm-256color", COLUMNS=str(_COLUMNS), LINES=str(_ROWS))


def drain(master: int) -> None:
    """Read what is written; take pictures out of the shared memory."""
    while True:
        ready, _, _ = select.select([master], [], [], 0.01)
        try:
            if ready and not os.read(master, 1 << 20):
                return
        except OSError:
            return
        for path in Path("/dev/shm").glob("navapp-*-[01]"):
            path.unlink(missing_ok=True)


def wait_until(runner: SessionRunner, state: SessionState) -> None:
    """Of the session; gives up after two minutes."""
    end_s = time.monotonic() + 120.0
    while runner.snapshot().state is not state:
        if time.monotonic() > end_s:
            raise TimeoutError(f"the session is {runner.snapshot().state}")
        time.sleep(0.05)


async def show(app: NavigationApp) -> None:
    """The screen for one turn."""
    asyncio.get_running_loop().call_later(_TURN_S, app.exit, 0)
    await app.run_async()


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", choices=("kitty", "sixel", "blocks"), default="kitty")
    parser.add_argument("--turns", type=int, default=6)
    options = parser.parse_args()
    result = os.fdopen(os.dup(1), "w")
    frames = make_frames()
    Terminal()
    times_ms: dict[bool, list[float]] = {False: [], True: []}
    is_shown, counts_from_s = [False], [0.0]
    session = make_session(frames)

    def note(outcome: object) -> None:
        total = outcome.timings.total_ms  # type: ignore[attr-defined]
        if is_warm.is_set() and time.monotonic() > counts_from_s[0]:
            times_ms[is_shown[0]].append(total)

    is_warm = threading.Event()
    with ExitStack() as undo, tempfile.TemporaryDirectory() as folder:
        undo.callback(session.opened.devices.close)
        controller = make_controller(session, is_inline=False, on_frame=[note], undo=undo)
        runner = SessionRunner(controller)
        undo.callback(runner.stop)
        runner.start()
        wait_until(runner, SessionState.READY)
        runner.submit(Register())
        wait_until(runner, SessionState.REVIEW)
        runner.submit(Accept(runner.snapshot().candidate_id))
        wait_until(runner, SessionState.NAVIGATING)
        encoder = {
            "kitty": KittyEncoder(is_local=True),
            "sixel": SixelEncoder(),
            "blocks": BlockEncoder(is_true_colour=True),
        }
        cell_px = CELL_PX if options.pictures == "blocks" else _CELL_PX
        graphics = Graphics(encoder[options.pictures], cell_px)
        for turn in range(options.turns + 1):
            for is_on in (False, True):
                is_shown[0], counts_from_s[0] = is_on, time.monotonic() + _WARM_S
                if is_on:
                    with own_terminal(Path(folder) / "log"):
                        asyncio.run(show(NavigationApp(runner, graphics=graphics)))
                else:
                    time.sleep(_TURN_S)
            if turn == 0:
                is_warm.set()
    tell(result, options.pictures, times_ms)


def tell(result: TextIO, pictures: str, times_ms: dict[bool, list[float]]) -> None:
    """A row for each, and the ratios."""
    rows = {}
    for is_on, times in times_ms.items():
        rows[is_on] = np.percentile(times, [50, 99])
        name = pictures if is_on else "no screen"
        print(f"{name}: {len(times)} frames, {rows[is_on].round(1)} ms at p50, p99", file=result)
    print(f"with the screen over without: {np.round(rows[True] / rows[False], 3)}", file=result)


if __name__ == "__main__":
    sys.exit(main())
