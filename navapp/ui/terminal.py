"""Takes over the terminal for the screen; output of libraries goes to a log."""

import contextlib
import io
import os
import select
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from navapp.errors import InputError, UsageError
from navapp.ui.pictures.painter import PictureText


@contextlib.contextmanager
def own_terminal(log_path: Path) -> Iterator[None]:
    """Send file descriptors 1 and 2 to a log; only `sys.__stdout__`, `__stderr__` stay terminal.

    Textual writes to `sys.__stderr__`. Native code writes to the descriptors, Python code to
    `sys.stdout` and `sys.stderr`, which keep theirs; so all of that ends in the log.

    Raises:
        UsageError: there is no terminal.
        InputError: the log cannot be written.
    """
    check_terminal()
    log = _open_log(log_path)
    sys.stdout.flush()
    sys.stderr.flush()
    saved = os.dup(1), os.dup(2)
    streams = sys.__stdout__, sys.__stderr__
    terminal = _LosableTerminal(os.dup(1), sys.stdout.encoding or "utf-8")
    os.dup2(log, 1)
    os.dup2(log, 2)
    os.close(log)
    sys.__stdout__ = sys.__stderr__ = terminal  # type: ignore[misc]
    try:
        yield
    finally:
        sys.__stdout__, sys.__stderr__ = streams  # type: ignore[misc]
        terminal.close()
        sys.stdout.flush()
        sys.stderr.flush()
        os.dup2(saved[0], 1)
        os.dup2(saved[1], 2)
        for descriptor in saved:
            os.close(descriptor)


def check_terminal() -> None:
    """Refuse a screen where nobody would see it.

    Raises:
        UsageError: there is no terminal.
    """
    if not (os.isatty(0) and os.isatty(1)):
        raise UsageError(
            "the operator's screen needs a terminal", remedy="start it in one, or add --headless"
        )


def is_terminal_lost() -> bool:
    """Whether the terminal was closed: nobody sees the screen or presses a key any more."""
    watch = select.poll()
    watch.register(0, 0)
    return bool(watch.poll(0))  # hang-up and error are told without being asked for


class _LosableTerminal(io.TextIOWrapper):
    """Writes to a terminal; once that is closed, text is dropped.

    Textual's thread for output would end at the error, and its screen then wait for it for ever.
    """

    def __init__(self, descriptor: int, encoding: str) -> None:
        file = open(descriptor, "wb")  # noqa: SIM115 (closed with this one)
        super().__init__(file, encoding=encoding, errors="replace", line_buffering=True)

    def write(self, text: str) -> int:
        """Write what can be written; the length of the text."""
        with contextlib.suppress(OSError):
            super().write(text)
        if isinstance(text, PictureText):
            text.sent_s = time.monotonic()
        return len(text)

    def flush(self) -> None:
        """As `write`."""
        with contextlib.suppress(OSError):
            super().flush()

    def close(self) -> None:
        """As `write`."""
        with contextlib.suppress(OSError):
            super().close()


def _open_log(log_path: Path) -> int:
    try:
        log_path.parent.mkdir(parents=True, exist_ok=True)
        return os.open(log_path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    except OSError as error:
        raise InputError(
            f"{log_path}: the log cannot be written ({error.strerror})",
            subject=str(log_path),
            remedy="choose another folder",
        ) from error
