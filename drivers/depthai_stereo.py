"""The mono pair of an OAK camera: exposed on one signal, sent as one message."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import timedelta
from typing import Any

from drivers.clock import Clock
from drivers.depthai_calibration import make_factory_rig
from drivers.depthai_messages import DepthaiPair, pair_of
from drivers.depthai_parts import DepthaiParts, open_parts
from drivers.depthai_settings import DepthaiSettings
from drivers.frames import FrameMeter, StereoFrame
from drivers.interfaces import CameraInfo
from drivers.pair_gate import PairGate
from navapp.errors import (
    DeviceLost,
    DeviceNotFound,
    DeviceTimeout,
    RigError,
    UnsupportedControl,
    WrongDevice,
)
from navapp.geometry.rig import StereoRig

OpenParts = Callable[[DepthaiSettings], DepthaiParts]

_LOST_AFTER_NS = 3_000_000_000
# A new exposure is in the pictures after a few frames of the sensor's pipeline.
_MOST_FRAMES_TO_SETTLE = 20
_NEARNESS = 0.1
_FAST = ("SUPER", "SUPER_PLUS")
# A closed camera starts anew and is absent meanwhile.
_RESTART_NS, _SEARCH_EVERY_NS = 6_000_000_000, 250_000_000
# When those that were closed are back at the latest; whoever closed them, they are absent for all.
_BACK_BY_NS: dict[str, int] = {}


class DepthaiStereo:
    """Free-running OAK stereo camera; opening it again refuses another camera in its place."""

    def __init__(
        self,
        settings: DepthaiSettings,
        clock: Clock,
        *,
        rig_id: str = "",
        open_device: OpenParts = open_parts,
    ) -> None:
        """Set up; nothing is imported or opened before `open`.

        Args:
            settings: which camera, and how it works.
            clock: the host's monotonic one, to which DepthAI maps the camera's.
            rig_id: of the rig that the frames are for.
            open_device: what boots a camera.
        """
        self._settings = settings
        self._clock = clock
        self._rig_id = rig_id
        self._open_device = open_device
        self._parts: DepthaiParts | None = None
        self._device_id = ""
        self._rig: StereoRig | None = None
        self._notes: tuple[str, ...] = ()
        self._controls: dict[str, float] = {}
        self._is_lost = False
        self._gate = self._new_gate()
        self._sequence = 0
        self._meter = FrameMeter()

    @property
    def info(self) -> CameraInfo:
        """Identity and measured behaviour; counts are those of the present opening."""
        return CameraInfo(
            name=f"depthai:{self._settings.device or 'oak'}",
            backend="depthai",
            is_simulated=False,
            is_stepped=False,
            width=self._settings.width,
            height=self._settings.height,
            serials=(self._device_id, self._device_id),
            measured_rate_hz=self._meter.rate_hz,
            measured_skew_ms=self._meter.skew_ms,
            factory_rig=self._rig,
            n_unpaired=self._gate.n_unpaired,
            n_stale=self._gate.n_stale,
            controls=dict(self._controls),
            notes=self._notes,
        )

    def open(self) -> None:
        """Boot it, which takes seconds.

        Raises:
            DeviceNotFound: no package, no camera, or it does not boot. DeviceLost: gone again.
            WrongDevice: another one than at the first opening.
            DeviceError, UnsupportedControl: it refuses size, rate or an infrared lamp.
        """
        if self._parts is not None:
            return
        parts = self._boot()
        try:
            self._take_over(parts)
        except BaseException:
            self._release(parts)
            raise
        self._parts = parts

    def read(self, timeout_s: float) -> StereoFrame:
        """The newest pair.

        Raises:
            DeviceTimeout, DeviceLost: see `StereoCamera.read`.
            DeviceProtocolError: pictures of another size.
        """
        deadline_s = time.monotonic() + timeout_s
        while True:
            group = self._group(max(0.0, deadline_s - time.monotonic()))
            if group is None:
                raise self._silence(timeout_s)
            shape = self._settings.height, self._settings.width
            frame = self._frame(pair_of(group, shape, self._device_id))
            if frame is not None:
                return frame
            if time.monotonic() > deadline_s:
                raise self._silence(timeout_s)

    def set(self, control: str, value: float) -> float:
        """Set a control of both eyes; it survives a reopening.

        Exposure and sensitivity are read back from the pictures, which are dropped meanwhile; the
        camera does not tell the brightness of its lamps, only that it took it.

        Raises:
            UnsupportedControl: see `StereoCamera.set`.
            DeviceLost, DeviceTimeout: not open, or no picture.
        """
        limits = self._settings.limits()
        low, high = limits.get(control, (1.0, 0.0))
        if not low <= value <= high:
            raise UnsupportedControl(
                f"an OAK camera cannot set {control} to {value:g}",
                subject=control,
                remedy=f"use {low:g} to {high:g}" if control in limits else f"use {list(limits)}",
            )
        parts = self._running()
        controls = {**self._settings.controls, control: value}
        if control in ("exposure_ms", "iso"):
            with self._report_lost_device():
                parts.send_exposure(controls["exposure_ms"], controls["iso"])
            has = self._wait_until_settled(control, value)
        else:
            has = self._light(parts, control, value)
        self._settings = replace(self._settings, controls=controls)
        return has

    def close(self) -> None:
        """Stop and release; the camera then starts anew, for some seconds."""
        parts, self._parts = self._parts, None
        if parts is not None:
            self._release(parts)

    def _boot(self) -> DepthaiParts:
        """Open the device; one that was closed in good health is waited for."""
        while True:
            try:
                return self._open_device(self._settings)
            except DeviceNotFound:
                now_ns = self._clock.now_ns()
                if now_ns >= self._back_by_ns():
                    raise
                self._clock.wait_until_ns(now_ns + _SEARCH_EVERY_NS)

    def _back_by_ns(self) -> int:
        wanted = self._settings.device or self._device_id
        back_by = tuple(_BACK_BY_NS.items())
        return max((at_ns for device_id, at_ns in back_by if wanted in ("", device_id)), default=0)

    def _release(self, parts: DepthaiParts) -> None:
        with suppress(Exception):  # a camera that is gone cannot be told so
            parts.close()
        if not self._is_lost:
            _BACK_BY_NS[parts.device_id] = self._clock.now_ns() + _RESTART_NS

    def _take_over(self, parts: DepthaiParts) -> None:
        if self._device_id and parts.device_id != self._device_id:
            raise WrongDevice(
                f"OAK camera {parts.device_id} stands where {self._device_id} stood at first",
                subject=parts.device_id,
                remedy="connect the camera that it began with",
            )
        self._device_id, self._is_lost = parts.device_id, False
        _BACK_BY_NS.pop(self._device_id, None)
        self._controls = {}
        for lamp in ("ir_dots", "ir_flood"):
            brightness = self._settings.controls[lamp]
            if brightness > 0.0:
                self._light(parts, lamp, brightness)
        notes = [f"USB {parts.usb_speed}, booted in {parts.boot_s:.1f} s"]
        if parts.usb_speed not in _FAST:
            notes.append("the link is slow: use a USB 3 port and cable")
        try:
            self._rig = make_factory_rig(
                parts.calibration, self._settings.width, self._settings.height, self._device_id
            )
        except RigError as error:
            self._rig = None
            notes.append(str(error))
        self._notes = tuple(notes)
        self._gate = self._new_gate()
        self._meter = FrameMeter()

    def _light(self, parts: DepthaiParts, lamp: str, brightness: float) -> float:
        with self._report_lost_device():
            is_taken = parts.set_infrared(lamp, brightness)
        if not is_taken:
            raise UnsupportedControl(
                f"OAK camera {parts.device_id} has no lamp {lamp}",
                subject=lamp,
                remedy="leave it at 0, or use a camera with infrared projectors",
            )
        self._controls[lamp] = brightness
        return brightness

    def _wait_until_settled(self, control: str, wish: float) -> float:
        """What the pictures say, once that is near the wish or no longer expected to be."""
        for _ in range(_MOST_FRAMES_TO_SETTLE):
            self.read(1.0)
            if abs(self._controls[control] - wish) <= _NEARNESS * wish:
                break
        return self._controls[control]

    def _group(self, timeout_s: float) -> Any:
        """The next message of both eyes."""
        parts = self._running()
        with self._report_lost_device():
            return parts.queue.get(timedelta(seconds=timeout_s))

    @contextmanager
    def _report_lost_device(self) -> Iterator[None]:
        """DepthAI has no one error for a link that is gone."""
        try:
            yield
        except Exception as error:
            self._is_lost = True
            raise DeviceLost(
                f"OAK camera {self._device_id} is gone ({error})",
                subject=self._device_id,
                remedy="plug it in again; it is opened by itself",
            ) from error

    def _frame(self, pair: DepthaiPair) -> StereoFrame | None:
        """None for a pair that is not handed out."""
        now_ns = self._clock.now_ns()
        if not self._gate.admits(pair.captured_ns, pair.skew_ns, now_ns):
            return None
        self._controls["exposure_ms"], self._controls["iso"] = pair.exposure_ms, pair.iso
        self._sequence += 1
        frame = StereoFrame(
            pair.left,
            pair.right,
            pair.captured_ns,
            now_ns,
            pair.skew_ns,
            self._sequence,
            self._rig_id,
        )
        self._meter.add(frame)
        return frame

    def _new_gate(self) -> PairGate:
        return PairGate(
            max_skew_ns=round(self._settings.max_skew_ms * 1e6),
            max_age_ns=round(self._settings.max_age_ms * 1e6),
            heard_ns=self._clock.now_ns(),
        )

    def _running(self) -> DepthaiParts:
        if self._parts is None:
            name = self.info.name
            raise DeviceLost(f"camera {name} is not open", subject=name, remedy="open it first")
        return self._parts

    def _silence(self, timeout_s: float) -> DeviceTimeout | DeviceLost:
        silent_ns = self._clock.now_ns() - self._gate.heard_ns
        if silent_ns > _LOST_AFTER_NS:
            self._is_lost = True
            return DeviceLost(
                f"OAK camera {self._device_id} has given no new pair for {silent_ns * 1e-9:.0f} s",
                subject=self._device_id,
                remedy="plug it in again; it is opened by itself",
            )
        return DeviceTimeout(
            f"OAK camera {self._device_id} gave no pair within {timeout_s:g} s",
            subject=self._device_id,
        )
