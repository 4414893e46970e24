"""Steps a controller: in a loop for headless sessions, in a thread for the screen."""

import math
import threading
from collections.abc import Callable
from dataclasses import replace

from navapp.control.commands import Command
from navapp.control.controller import SessionController
from navapp.control.operators import Operator
from navapp.control.states import Progress, SessionState, Snapshot
from navapp.geometry.compilation import Compilation, watch_compilation

_PATIENCE_NS = 10_000_000_000


def run_headless(
    controller: SessionController,
    operator: Operator,
    is_done: Callable[[], bool] = lambda: False,
) -> Snapshot:
    """Step until the source ends or `is_done`; the operator answers every snapshot.

    A fault that stays for `_PATIENCE_NS` ends it as well: nobody is there to mend it. The
    controller's `failure` then says why.
    """
    snapshot = controller.snapshot
    last_well_ns = snapshot.time_ns
    while not (snapshot.is_over or is_done()):
        if snapshot.state is not SessionState.FAULT:
            last_well_ns = snapshot.time_ns
        elif snapshot.time_ns - last_well_ns > _PATIENCE_NS:
            break
        commands = operator.commands(snapshot)
        for command in commands:
            controller.submit(command)
        for _ in commands:
            snapshot = controller.step()
        # One frame between two answers of the operator, as for a person.
        snapshot = controller.step()
    return snapshot


class SessionRunner:
    """Steps a controller in a thread of its own; `snapshot` and `submit` never block."""

    def __init__(self, controller: SessionController) -> None:
        self._controller = controller
        self._stopping = threading.Event()
        self._compilation = Compilation()
        self._thread = threading.Thread(target=self._run, name="pipeline", daemon=True)
        self.error: Exception | None = None

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def snapshot(self) -> Snapshot:
        """The newest one, judged at this moment: also while a step hangs."""
        snapshot = self._controller.snapshot_now()
        if not self._compilation.is_running:
            return snapshot
        what = f"compiling kernels, once on a machine: {self._compilation.count} so far"
        return replace(snapshot, progress=Progress(what, math.nan))

    def submit(self, command: Command) -> None:
        """Hand a command over."""
        self._controller.submit(command)

    def stop(self) -> None:
        """End the loop and close the devices; safe to call twice."""
        self._stopping.set()
        # A step that hangs must not leave its picture on the display.
        self._controller.darken()
        if self._thread.ident is not None:
            self._thread.join(10.0)
        else:
            self._controller.close()

    def _run(self) -> None:
        try:
            with watch_compilation() as self._compilation:
                while not self._stopping.is_set() and not self._controller.snapshot.is_over:
                    self._controller.step()
        except Exception as error:  # noqa: BLE001 (kept for the caller; the display must go dark)
            self.error = error
        finally:
            self._controller.close()
