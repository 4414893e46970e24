"""Which code, libraries and machine a result is of."""

import os
import platform
import re
import subprocess
from functools import cache
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np

from navapp import __version__
from navapp.environment import source_hash


@cache
def describe_origin() -> str:
    """One line: version, hash and commit of the code, versions of its libraries, the machine."""
    commit = find_commit(Path(__file__).resolve().parents[2])
    code = f"source {source_hash()}" + ("" if commit is None else f", commit {commit}")
    libraries = ", ".join(f"{name} {number}" for name, number in list_libraries().items())
    return f"navapp {__version__}, {code}; {libraries}; {name_processor()}, {os.cpu_count()} cores"


def list_libraries() -> dict[str, str]:
    """Versions of what the figures depend on."""
    return {
        "Python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": version("scipy"),
        "numba": version("numba"),
        "OpenCV": cv2.__version__,
    }


def find_commit(folder: Path) -> str | None:
    """The commit of a git checkout, with "-dirty" where files were changed; None of anything else.

    Args:
        folder: its top.
    """
    if not (folder / ".git").exists():
        return None
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=8"]
    try:
        told = subprocess.run(command, capture_output=True, text=True, timeout=10.0, check=True)
    except (OSError, subprocess.SubprocessError):  # no git, or not allowed to read it
        return None
    return told.stdout.strip() or None


@cache
def name_processor() -> str:
    """The computer's processor."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    named = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    return named[1] if named else platform.machine()
