"""A slot for the newest frame, and the thread that fills it."""

import threading
from typing import Generic, TypeVar

from drivers.frames import StereoFrame
from drivers.interfaces import StereoCamera
from navapp.errors import DeviceLost, DeviceTimeout, NavappError

T = TypeVar("T")


class LatestSlot(Generic[T]):
    """Holds one value; a newer one replaces an unread one, and the drop is counted."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._value: T | None = None
        self._has_value = False
        self._error: Exception | None = None
        self._n_dropped = 0

    @property
    def n_dropped(self) -> int:
        """Values that were replaced before anyone took them."""
        with self._condition:
            return self._n_dropped

    def put(self, value: T) -> None:
        """Store the newest value."""
        with self._condition:
            self._n_dropped += int(self._has_value)
            self._value, self._has_value = value, True
            self._condition.notify()

    def fail(self, error: Exception) -> None:
        """Make every further `take` raise, once the last value is taken."""
        with self._condition:
            self._error = error
            self._condition.notify_all()

    def take(self, timeout_s: float) -> T | None:
        """Remove and return the newest value; None when nothing came in time.

        Raises:
            Exception: whatever was handed to `fail`.
        """
        with self._condition:
            self._condition.wait_for(lambda: self._has_value or self._error is not None, timeout_s)
            if self._has_value:
                value, self._value, self._has_value = self._value, None, False
                return value
            if self._error is not None:
                raise self._error
            return None


class ReaderThread:
    """Reads a free-running camera into a `LatestSlot` until stopped.

    The thread owns the camera while it runs: it opens nothing, but closes the camera at its end.
    A time-out is not the end; any other error of the camera is kept for the reader of the slot.

    Attributes:
        silence: what the camera said when it gave no frame in time; empty since it gave one.
    """

    def __init__(
        self,
        camera: StereoCamera,
        slot: LatestSlot[StereoFrame],
        timeout_s: float = 0.5,
    ) -> None:
        self._camera = camera
        self._slot = slot
        self._timeout_s = timeout_s
        self._name = ""
        self.silence = ""
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="camera-reader", daemon=True)

    def start(self) -> None:
        """Begin reading; the camera must be open."""
        self._name = self._camera.info.name
        self._thread.start()

    def stop(self, timeout_s: float = 5.0) -> bool:
        """Ask it to end and wait; False when the camera still blocks it."""
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            while not self._stopping.is_set():
                try:
                    self._slot.put(self._camera.read(self._timeout_s))
                    self.silence = ""
                except DeviceTimeout as error:
                    self.silence = str(error)
        except NavappError as error:
            self._slot.fail(error)
        except Exception as error:  # noqa: BLE001 (a driver's bug must end as a lost device, not as a silent thread)
            lost = DeviceLost(f"camera {self._name} failed: {error}")
            lost.__cause__ = error
            self._slot.fail(lost)
        finally:
            self._camera.close()
