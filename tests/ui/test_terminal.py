"""The whole screen on a pseudo-terminal, in a process of its own."""

import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.many import few_of

pytestmark = pytest.mark.waits

ROOT = Path(__file__).parents[2]

PROGRAM = """
import ctypes, sys
from pathlib import Path
from navapp.ui.run_screen import run_screen
from tests.ui import snapshots

class Session(snapshots.ScriptedSession):
    n = 0
    def snapshot(self):
        self.n += 1
        if self.n == 4:
            ctypes.CDLL(None).puts(b"NATIVE NOISE")
            ctypes.CDLL(None).fflush(None)
        if self.n == 5 and sys.argv[2] == "break":
            raise ValueError("no such luck")
        return self.current
    def stop(self):
        Path(sys.argv[1]).joinpath("stopped").write_text("yes")

sys.exit(run_screen(Session(getattr(snapshots, sys.argv[3])()), Path(sys.argv[1]) / "ui.log"))
"""


class Screen:
    """A child on a pseudo-terminal."""

    def __init__(self, folder: Path, mode: str, state: str = "review") -> None:
        self.master, slave = pty.openpty()
        environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "80", "LINES": "24"}
        self.process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, str(folder), mode, state],
            stdin=slave,
            stdout=slave,
            stderr=subprocess.PIPE,
            cwd=ROOT,
            env=environment,
            start_new_session=True,
        )
        os.close(slave)
        self.seen = b""

    def read_until(self, text: bytes, limit_s: float = 20.0) -> None:
        end = time.monotonic() + limit_s
        while text not in self.seen and time.monotonic() < end:
            ready, _, _ = select.select([self.master], [], [], 0.1)
            if ready:
                try:
                    self.seen += os.read(self.master, 65536)
                except OSError:
                    break
        assert text in self.seen

    def finish(self) -> tuple[int, str]:
        """Exit code and what was said on the standard error; the terminal is drained meanwhile."""
        end = time.monotonic() + 20.0
        while self.process.poll() is None and time.monotonic() < end:
            ready, _, _ = select.select([self.master], [], [], 0.05)
            if ready:
                try:
                    self.seen += os.read(self.master, 65536)
                except OSError:
                    time.sleep(0.02)
        _, said = self.process.communicate(timeout=5)
        return self.process.returncode, said.decode()

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()
        if self.master >= 0:
            os.close(self.master)
            self.master = -1


def test_keys_end_it_and_native_noise_stays_out_of_the_picture(tmp_path: Path) -> None:
    screen = Screen(tmp_path, "run")
    try:
        screen.read_until(b"NAVIGABLE")
        end = time.monotonic() + 10
        log = tmp_path / "ui.log"
        while b"NATIVE NOISE" not in log.read_bytes() and time.monotonic() < end:
            select.select([screen.master], [], [], 0.05)
        os.write(screen.master, b"q")
        assert screen.finish() == (0, "")
        assert b"NATIVE NOISE" in log.read_bytes()
        assert b"NATIVE NOISE" not in screen.seen
        assert (tmp_path / "stopped").exists()
    finally:
        screen.close()


@pytest.mark.release
def test_the_mouse_is_asked_for(tmp_path: Path) -> None:
    screen = Screen(tmp_path, "run")
    try:
        screen.read_until(b"\x1b[?1000h")
        os.write(screen.master, b"q")
        assert screen.finish() == (0, "")
    finally:
        screen.close()


@pytest.mark.parametrize("number", few_of([signal.SIGTERM, signal.SIGHUP]))
def test_a_signal_ends_it_in_order(tmp_path: Path, number: signal.Signals) -> None:
    screen = Screen(tmp_path, "run")
    try:
        screen.read_until(b"NAVIGABLE")
        os.kill(screen.process.pid, number)
        assert screen.finish() == (128 + number, "")
        assert (tmp_path / "stopped").exists()
        assert b"\x1b[?1049l" in screen.seen
    finally:
        screen.close()


@pytest.mark.parametrize("is_told", few_of([True, False]))
def test_a_closed_terminal_stops_the_session(tmp_path: Path, is_told: bool) -> None:
    screen = Screen(tmp_path, "run")
    try:
        screen.read_until(b"NAVIGABLE")
        os.close(screen.master)
        screen.master = -1
        if is_told:
            os.kill(screen.process.pid, signal.SIGHUP)
        screen.process.communicate(timeout=20)
        assert screen.process.returncode == 128 + signal.SIGHUP
        assert (tmp_path / "stopped").exists()
    finally:
        screen.close()


@pytest.mark.release
def test_a_failure_is_one_sentence_and_the_traceback_is_in_the_log(tmp_path: Path) -> None:
    screen = Screen(tmp_path, "break")
    try:
        code, said = screen.finish()
        assert code == 1
        assert said.count("\n") == 1
        assert said.startswith("navapp: error: the screen failed (ValueError: no such luck)")
        assert b"Traceback" not in screen.seen
        assert "Traceback" in (tmp_path / "ui.log").read_text()
        assert (tmp_path / "stopped").exists()
    finally:
        screen.close()


def test_without_a_terminal_it_says_so(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path), "run", "review"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        cwd=ROOT,
        check=False,
        text=True,
        timeout=30,
    )
    assert done.returncode == 2
    assert "needs a terminal" in done.stderr
    assert "--headless" in done.stderr
    assert (tmp_path / "stopped").exists()
