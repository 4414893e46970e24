"""Takes frames from the camera, notices its silence and loss, and opens it again."""

from collections.abc import Callable

from drivers.clock import Clock
from drivers.frames import StereoFrame
from drivers.interfaces import StereoCamera
from navapp.control.backoff import Backoff
from navapp.control.frame_sources import FrameSource, open_source
from navapp.errors import DeviceError, NavappError

# A camera that is plugged in again starts for some seconds, and each attempt costs the bus a reset.
_PAUSES_S = (1.0, 4.0)
_SILENT_AFTER_NS = 1_000_000_000

Reopen = Callable[[], StereoCamera]


class CameraLink:
    """Takes frames from an opened camera and opens it again when it was lost.

    Attributes:
        camera: the camera in use.
        trouble: what is wrong with it, empty when nothing is.
    """

    def __init__(self, camera: StereoCamera, clock: Clock, reopen: Reopen | None) -> None:
        self.camera = camera
        self.trouble = ""
        self._clock = clock
        self._reopen = reopen
        self._source: FrameSource | None = open_source(camera)
        self._lost_source: FrameSource | None = None
        self._last_frame_ns = clock.now_ns()
        self._retry_at_ns = 0
        self._backoff = Backoff(*_PAUSES_S)

    @property
    def is_down(self) -> bool:
        """The camera was lost and is not back yet."""
        return self._source is None

    @property
    def can_return(self) -> bool:
        """Somebody knows how to open it again."""
        return self._reopen is not None

    @property
    def is_silent(self) -> bool:
        """It is open, but no frame has come for a second."""
        waited_ns = self._clock.now_ns() - self._last_frame_ns
        return self._source is not None and waited_ns > _SILENT_AFTER_NS

    @property
    def silence(self) -> str:
        """Why it is silent, as far as it says; empty when it is not."""
        if self._source is None or not self.is_silent:
            return ""
        return self._source.silence or "sends no picture"

    @property
    def n_dropped(self) -> int:
        """Frames that were replaced by newer ones before they were taken."""
        return 0 if self._source is None else self._source.n_dropped

    def take(self, timeout_s: float) -> StereoFrame | None:
        """The next frame, or None.

        Raises:
            DeviceError: the camera is lost from now on; `wait_for_return` brings it back.
            EndOfSequence: a recording is at its end.
        """
        if self._source is None:
            return None
        try:
            frame = self._source.take(timeout_s)
        except DeviceError as error:
            # Closing may wait for a reader that hangs: the caller makes the display dark first.
            self._lost_source, self._source = self._source, None
            self.trouble = str(error)
            self._backoff.reset()
            self._pause()
            raise
        if frame is not None:
            self._last_frame_ns = self._clock.now_ns()
        return frame

    def retry_now(self) -> None:
        """Try at the next opportunity, without the pause between attempts."""
        self._retry_at_ns = 0

    def wait_for_return(self, timeout_s: float) -> bool:
        """Wait for the time of the next attempt, or make it; whether the camera is back."""
        self._release()
        now_ns = self._clock.now_ns()
        if now_ns < self._retry_at_ns:
            # A manual clock only moves when somebody waits.
            self._clock.wait_until_ns(min(self._retry_at_ns, now_ns + round(timeout_s * 1e9)))
            return False
        if self._reopen is None:
            self._pause()
            return False
        try:
            self.camera = self._reopen()
        except Exception as error:  # noqa: BLE001 (a bug must be told, not end the session)
            is_told = isinstance(error, NavappError)
            self.trouble = str(error) if is_told else f"opening the camera failed: {error!r}"
            # From the end of the attempt: one that takes long must not follow upon itself.
            self._pause()
            return False
        self._source = open_source(self.camera)
        self._last_frame_ns = self._clock.now_ns()
        self.trouble = ""
        return True

    def close(self) -> None:
        """Stop reading; the camera is closed as well."""
        self._release()
        if self._source is not None:
            self._source.close()
        self.camera.close()

    def _pause(self) -> None:
        self._retry_at_ns = self._clock.now_ns() + round(self._backoff.next_pause_s() * 1e9)

    def _release(self) -> None:
        if self._lost_source is not None:
            self._lost_source.close()
            self._lost_source = None
