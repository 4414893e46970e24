"""Stereo camera of USB cameras through OpenCV: two, or one that sends both eyes side by side."""

import threading
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace

from drivers.clock import Clock
from drivers.frames import FrameMeter, StereoFrame
from drivers.interfaces import CameraInfo
from drivers.uvc_camera import OpenCapture, UvcCamera, open_v4l
from drivers.uvc_controls import check_control
from drivers.uvc_pairs import UvcPairs
from drivers.uvc_settings import UvcSettings
from drivers.v4l_names import FoundCamera, V4lNames
from navapp.errors import DeviceError, DeviceLost, UnsupportedControl, UsageError, WrongDevice


@dataclass(frozen=True, slots=True)
class OpencvStereoSettings:
    """Which USB cameras, and their settings.

    Raises:
        UsageError: the same camera twice, a limit at which a picture has two partners.
    """

    left: str  # serial number, or path below `/dev/v4l/by-id` or `/dev/v4l/by-path`
    right: str | None  # the same; None when the left one sends both eyes side by side
    eye: UvcSettings  # format and controls; the width is that of one eye
    max_skew_ms: float = 5.0  # pairs whose pictures are farther apart in time are not made

    def __post_init__(self) -> None:
        if not self.left or self.right == "":
            raise UsageError(
                "no camera is named", remedy="give the serial numbers of the left and right one"
            )
        half_period_ms = 500.0 / self.eye.rate_hz
        if not 0.0 <= self.max_skew_ms < half_period_ms:
            raise UsageError(
                f"a skew of {self.max_skew_ms:g} ms is not below half of the frame period",
                subject="max_skew_ms",
                remedy=f"use less than {half_period_ms:g}",
            )


class OpencvStereo:
    """Free-running stereo camera; it is lost as a whole when one eye is.

    Opened again, it is the same cameras with the same settings, or refused.
    """

    def __init__(
        self,
        settings: OpencvStereoSettings,
        clock: Clock,
        *,
        rig_id: str = "",
        names: V4lNames | None = None,
        open_capture: OpenCapture = open_v4l,
    ) -> None:
        """Set up; nothing is opened before `open`.

        Args:
            settings: which cameras, and how they work.
            clock: the host's monotonic one, of which the drivers' stamps are.
            rig_id: of the rig that the frames are for.
            names: where cameras are looked up.
            open_capture: what opens a path.
        """
        self._settings = settings
        self._clock = clock
        self._rig_id = rig_id
        self._names = names or V4lNames()
        self._open_capture = open_capture
        self._lock = threading.Lock()
        self._pairs: UvcPairs | None = None
        self._serials = ("", "")
        self._sequence = 0
        self._meter = FrameMeter()

    @property
    def info(self) -> CameraInfo:
        """Identity and measured behaviour; counts are those of the present opening."""
        pairs = self._pairs
        eye = self._settings.eye
        return CameraInfo(
            name=f"opencv:{self._settings.left}"
            + ("" if self._settings.right is None else f"+{self._settings.right}"),
            backend="opencv",
            is_simulated=False,
            is_stepped=False,
            width=eye.width,
            height=eye.height,
            serials=self._serials,
            measured_rate_hz=self._meter.rate_hz,
            measured_skew_ms=self._meter.skew_ms,
            n_unpaired=0 if pairs is None else pairs.n_unpaired,
            n_stale=0 if pairs is None else pairs.n_stale,
            controls={} if pairs is None else _common_controls(pairs),
            notes=() if pairs is None else _notes(pairs),
        )

    def open(self) -> None:
        """Find the cameras, lock their settings, begin to read.

        Raises:
            DeviceNotFound: not connected, or it cannot be opened.
            WrongDevice: another camera than at the first opening, or one for both eyes.
            DeviceError: a format, an automatic or a control that it refuses.
            UsageError: a name that names no camera for good.
        """
        with self._lock:
            if self._pairs is not None:
                return
            found = self._find()
            with ExitStack() as undo:
                cameras = []
                for identity in found:
                    camera = UvcCamera(
                        identity, self._make_sent_settings(), self._clock, self._open_capture
                    )
                    undo.callback(camera.close)
                    cameras.append(camera)
                undo.pop_all()
            self._serials = (found[0].serial, found[-1].serial)
            self._meter = FrameMeter()
            self._pairs = UvcPairs(
                tuple(cameras),
                self._clock,
                round(self._settings.max_skew_ms * 1e6),
                round(self._settings.eye.max_age_ms * 1e6),
            )

    def read(self, timeout_s: float) -> StereoFrame:
        """The newest pair.

        Raises:
            DeviceTimeout, DeviceLost: see `StereoCamera.read`.
        """
        pair = self._running().take(timeout_s)
        self._sequence += 1
        frame = StereoFrame(
            pair.left,
            pair.right,
            pair.captured_ns,
            pair.received_ns,
            pair.skew_ns,
            self._sequence,
            self._rig_id,
        )
        self._meter.add(frame)
        return frame

    def set(self, control: str, value: float) -> float:
        """Set a control of both eyes; a reopening asks for the same value again.

        Raises:
            UnsupportedControl: see `StereoCamera.set`; both eyes are then as they were.
            DeviceLost, DeviceTimeout: not open, or no answer.
        """
        check_control(control, value, self._settings.eye.rate_hz)
        pairs = self._running()
        before = {**_common_controls(pairs), **self._settings.eye.controls}
        try:
            has = pairs.set(control, value)
        except UnsupportedControl:
            if control in before:
                with suppress(DeviceError):
                    pairs.set(control, before[control])
            raise
        controls = {**self._settings.eye.controls, control: value}
        self._settings = replace(self._settings, eye=replace(self._settings.eye, controls=controls))
        return has

    def close(self) -> None:
        """Stop and release."""
        with self._lock:
            pairs, self._pairs = self._pairs, None
        if pairs is not None:
            pairs.close()

    def _running(self) -> UvcPairs:
        pairs = self._pairs
        if pairs is None:
            raise DeviceLost(
                f"camera {self.info.name} is not open",
                subject=self.info.name,
                remedy="open it before reading",
            )
        return pairs

    def _make_sent_settings(self) -> UvcSettings:
        """What each camera sends."""
        eye = self._settings.eye
        return eye if self._settings.right is not None else replace(eye, width=2 * eye.width)

    def _find(self) -> tuple[FoundCamera, ...]:
        wanted = [name for name in (self._settings.left, self._settings.right) if name is not None]
        found = tuple(self._names.find(name) for name in wanted)
        if len({camera.node for camera in found}) < len(found):
            raise WrongDevice(
                f"left and right are the same camera {found[0].serial}",
                subject=found[0].serial,
                remedy="name two cameras, or leave the right one out when it sends both eyes",
            )
        serials = (found[0].serial, found[-1].serial)
        if any(self._serials) and serials != self._serials:
            raise WrongDevice(
                f"cameras {' and '.join(serials)} stand where "
                f"{' and '.join(self._serials)} stood at first",
                subject=self.info.name,
                remedy="connect the cameras that it began with",
            )
        return found


def _common_controls(pairs: UvcPairs) -> Mapping[str, float]:
    """Controls as read back; of two eyes where both have the same value."""
    first, *others = (camera.controls for camera in pairs.cameras)
    return {
        name: value
        for name, value in first.items()
        if all(other.get(name) == value for other in others)
    }


def _notes(pairs: UvcPairs) -> tuple[str, ...]:
    sources = {None: "not known yet", True: "the driver's clock", False: "middle of the grab"}
    return tuple(
        f"{camera.identity.serial}: capture time is {sources[camera.has_stamps]}"
        + (f", the driver keeps {camera.n_buffers} pictures" if camera.n_buffers != 1 else "")
        for camera in pairs.cameras
    )
