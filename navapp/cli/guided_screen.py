"""Runs a guided session, as a capture, on the operator's screen."""

from collections.abc import Callable
from pathlib import Path
from typing import Any


def run_on_screen(session: Any, name: str, run_app: Callable[[Any, Path], int]) -> int:
    """The operator does it; 0, or the code of what ended the screen.

    Args:
        session: that is stepped in a thread of its own.
        name: of that thread.
        run_app: shows the running session; its log file is handed to it.

    Raises:
        Exception: what ended the session.
    """
    from navapp.cli.run import log_folder
    from navapp.control.guided_runner import GuidedRunner

    runner: GuidedRunner[Any, Any] = GuidedRunner(session, name)
    runner.start()
    try:
        code = run_app(runner, log_folder() / "navapp.log")
    finally:
        runner.stop()
    if runner.error is not None:
        raise runner.error
    return code
