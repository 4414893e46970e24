"""One USB camera behind OpenCV's capture object."""

import os
import time
from collections.abc import Callable

import cv2
import numpy as np

from drivers.capture_times import CaptureTimes
from drivers.clock import Clock
from drivers.pairing import TimedPicture
from drivers.uvc_controls import Capture, lock_controls, read_controls, set_control, set_format
from drivers.uvc_settings import UvcSettings
from drivers.v4l_names import FoundCamera
from navapp.errors import DeviceLost, DeviceNotFound, DeviceProtocolError

OpenCapture = Callable[[str], Capture]

# An unplugged camera fails at once, a stalled one after V4L2's second: both are lost after three.
_MOST_FAILURES = 3
_PAUSE_S = 0.001


def open_v4l(path: str) -> Capture:
    """OpenCV's capture of a video device; no other backend is tried."""
    return cv2.VideoCapture(path, cv2.CAP_V4L2)


class UvcCamera:
    """Opened with its format and controls locked; hands out new and fresh pictures only.

    All but the construction belongs to one thread at a time.

    Attributes:
        identity: which camera it is.
        controls: as the camera told them last.
        n_buffers: pictures that the driver keeps.
        n_stale: pictures that were too old when they were grabbed, or impossible to decode.
    """

    def __init__(
        self,
        identity: FoundCamera,
        settings: UvcSettings,
        clock: Clock,
        open_capture: OpenCapture = open_v4l,
    ) -> None:
        """Open it.

        Raises:
            DeviceNotFound: it cannot be opened.
            DeviceError: it refuses the format, or keeps an automatic.
            UnsupportedControl: it has no such control, or another value.
        """
        self.identity = identity
        self.n_stale = 0
        self._settings = settings
        self._clock = clock
        self._times = CaptureTimes()
        self._n_failed = 0
        self._is_proven = False
        self._capture = open_capture(str(identity.path))
        try:
            if not self._capture.isOpened():
                raise _make_unopened_error(identity)
            self.n_buffers = set_format(self._capture, settings, identity.serial)
            self.controls = lock_controls(self._capture, settings, identity.serial)
        except BaseException:
            self._capture.release()
            raise

    @property
    def has_stamps(self) -> bool | None:
        """Whether capture times are the driver's; None before the first picture."""
        return self._times.has_stamps

    def grab(self) -> TimedPicture | None:
        """Wait for the next picture; None when none came, or one that is old or known.

        Raises:
            DeviceLost: it failed several times in a row.
            DeviceProtocolError: the picture has another size than the camera said.
        """
        before_ns = self._clock.now_ns()
        if not self._capture.grab():
            self._count_failure()
            return None
        after_ns = self._clock.now_ns()
        self._n_failed = 0
        stamp_ms = self._capture.get(cv2.CAP_PROP_POS_MSEC)
        captured_ns = self._times.of(
            stamp_ms, before_ns, after_ns, self.controls.get("exposure_ms", 0.0)
        )
        if captured_ns is None:
            time.sleep(_PAUSE_S)  # some drivers hand out the last picture for ever, without waiting
            return None
        if after_ns - captured_ns > self._settings.max_age_ms * 1e6:
            self.n_stale += 1
            return None
        return self._decode(captured_ns)

    def set(self, control_name: str, value: float) -> float:
        """Ask for a control and return what the camera has.

        Raises:
            UnsupportedControl: see `set_control`.
        """
        rate_hz = self._settings.rate_hz
        try:
            return set_control(self._capture, control_name, value, rate_hz, self.identity.serial)
        finally:
            self.controls = read_controls(self._capture)

    def close(self) -> None:
        """Give the device back."""
        self._capture.release()

    def _decode(self, captured_ns: int) -> TimedPicture | None:
        is_read, picture = self._capture.retrieve()
        if not is_read or picture is None:
            self.n_stale += 1
            return None
        if picture.shape[:2] != (self._settings.height, self._settings.width):
            raise DeviceProtocolError(
                f"camera {self.identity.serial} sent a picture of "
                f"{picture.shape[1]}x{picture.shape[0]} where it had said "
                f"{self._settings.width}x{self._settings.height}",
                subject=self.identity.serial,
                remedy="open it again",
            )
        self._is_proven = True
        return TimedPicture(np.asarray(picture, dtype=np.uint8), captured_ns)

    def _count_failure(self) -> None:
        self._n_failed += 1
        if self._n_failed < _MOST_FAILURES:
            time.sleep(_PAUSE_S)
            return
        name = self.identity.serial
        if self._is_proven:
            raise DeviceLost(
                f"camera {name} gives no more pictures",
                subject=name,
                remedy="plug it in again; it is opened by itself",
            )
        raise DeviceLost(
            f"camera {name} was opened but gives no picture",
            subject=name,
            remedy="give each camera a USB controller of its own, or ask for MJPG or less",
        )


def _make_unopened_error(identity: FoundCamera) -> DeviceNotFound:
    if not identity.path.exists():
        remedy = "plug it in"
    elif not os.access(identity.path, os.R_OK | os.W_OK):
        remedy = "join the group that owns it (video), then log in again"
    else:
        remedy = "end the other program that uses it"
    return DeviceNotFound(
        f"camera {identity.serial} at {identity.path} cannot be opened",
        subject=identity.serial,
        remedy=remedy,
    )
