"""Jobs that processes of their own do: they find them here by name."""

import os
import signal
import time
from pathlib import Path

from navapp.errors import InputError


def note(folder: Path, number: int) -> None:
    """Leaves a file with the process's id."""
    (folder / f"{number}").write_text(str(os.getpid()))


def fail_at_two(folder: Path, number: int) -> None:
    """Raises at the third."""
    if number == 2:
        raise InputError("number 2 is damaged", subject="2", remedy="delete it")
    note(folder, number)


def die_at_two(folder: Path, number: int) -> None:
    """As when memory is short."""
    if number == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    note(folder, number)


def sleep(folder: Path, number: int) -> None:
    """Long enough to be waited for."""
    note(folder, number)
    time.sleep(60.0)


def sleep_but_first(folder: Path, number: int) -> None:
    """The first is done at once."""
    if number:
        sleep(folder, number)
