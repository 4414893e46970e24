"""Connects a simulated wire to a pseudo-terminal, which programs open like a serial port."""

import errno
import os
import select
import threading
import tty
from pathlib import Path

from sim_devices.firmware.wire import Wire

_PERIOD_S = 0.002


class PseudoTerminal:
    """Carries bytes between a wire and a terminal of the system, in a thread of its own.

    Attributes:
        path: a link to the terminal; it stays the same when the plug is pulled and put back.
    """

    def __init__(self, wire: Wire, path: Path) -> None:
        self._wire = wire
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self.path = path

    @property
    def wire(self) -> Wire:
        """To be touched inside `held` only, while plugged in."""
        return self._wire

    @property
    def held(self) -> threading.Lock:
        """Keeps the firmware still."""
        return self._lock

    def plug(self) -> None:
        """Make the terminal and its link."""
        master, slave = os.openpty()
        tty.setraw(slave)
        name = os.ttyname(slave)
        os.close(slave)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(name)
        self._stopping.clear()
        self._thread = threading.Thread(target=self._run, args=(master,), name="firmware")
        self._thread.start()

    def unplug(self) -> None:
        """The terminal is gone; safe to call twice."""
        self.path.unlink(missing_ok=True)
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
        self._thread = None

    def _run(self, master: int) -> None:
        try:
            while not self._stopping.is_set():
                data = _read(master)
                with self._lock:
                    if data:
                        self._wire.receive(data)
                    out = self._wire.take_arrived()
                if out:
                    os.write(master, out)
        finally:
            os.close(master)


def _read(master: int) -> bytes:
    """What the other end has sent; waits a little."""
    if not select.select([master], [], [], _PERIOD_S)[0]:
        return b""
    try:
        return os.read(master, 4096)
    except OSError as error:
        if error.errno != errno.EIO:
            raise
        # Nobody has it open: the system says so at once, again and again.
        threading.Event().wait(_PERIOD_S)
        return b""
