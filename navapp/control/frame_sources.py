"""Where the controller gets its frames: the same for stepped and for free-running cameras."""

from typing import Protocol

from drivers.frames import StereoFrame
from drivers.interfaces import StereoCamera
from drivers.latest import LatestSlot, ReaderThread
from navapp.errors import DeviceTimeout


class FrameSource(Protocol):
    """Hands out frames; raises what the camera raises."""

    @property
    def n_dropped(self) -> int:
        """Frames that were replaced by newer ones before they were taken."""
        ...

    @property
    def silence(self) -> str:
        """What the camera said when it gave no frame in time; empty since it gave one."""
        ...

    def take(self, timeout_s: float) -> StereoFrame | None:
        """The newest frame, or None when none came in time."""
        ...

    def close(self) -> None:
        """Stop; the camera is closed as well."""
        ...


class SteppedSource:
    """Reads the camera when asked: no thread, no drop."""

    def __init__(self, camera: StereoCamera) -> None:
        self._camera = camera
        self.n_dropped = 0
        self.silence = ""

    def take(self, timeout_s: float) -> StereoFrame | None:
        """The next frame."""
        try:
            frame = self._camera.read(timeout_s)
        except DeviceTimeout as error:
            self.silence = str(error)
            return None
        self.silence = ""
        return frame

    def close(self) -> None:
        """Close the camera."""
        self._camera.close()


class LiveSource:
    """A reader thread keeps the newest frame; older ones are dropped and counted."""

    def __init__(self, camera: StereoCamera) -> None:
        self._slot: LatestSlot[StereoFrame] = LatestSlot()
        self._reader = ReaderThread(camera, self._slot)
        self._reader.start()

    @property
    def n_dropped(self) -> int:
        """Frames that nobody took."""
        return self._slot.n_dropped

    @property
    def silence(self) -> str:
        """As the thread heard it."""
        return self._reader.silence

    def take(self, timeout_s: float) -> StereoFrame | None:
        """The newest frame since the last call."""
        return self._slot.take(timeout_s)

    def close(self) -> None:
        """Stop the thread; it closes the camera."""
        self._reader.stop()


def open_source(camera: StereoCamera) -> FrameSource:
    """The source that fits an opened camera."""
    return SteppedSource(camera) if camera.info.is_stepped else LiveSource(camera)
