"""Runs Python in a child process, so that output, hangs and crashes there do no harm."""

import os
import subprocess
import sys
from pathlib import Path


def make_child_environment() -> dict[str, str]:
    """This process's environment, in which Python finds these packages from any folder."""
    paths = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}


def run_python(*arguments: str, timeout_s: float) -> "subprocess.CompletedProcess[str]":
    """Run it to its end, without input; what it says is kept.

    Raises:
        subprocess.TimeoutExpired: it was ended by force.
    """
    return subprocess.run(
        [sys.executable, "-P", *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
        env=make_child_environment(),
    )


def find_last_words(done: "subprocess.CompletedProcess[str]") -> str:
    """Why it failed: the last line of its errors, else how it ended."""
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else f"it ended with code {done.returncode}"
