"""A stereo camera that looks into a simulated world."""

import math
import threading
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.frames import FrameMeter, Image, StereoFrame
from drivers.interfaces import CameraInfo
from navapp.errors import (
    DeviceLost,
    DeviceNotFound,
    DeviceTimeout,
    EndOfSequence,
    UnsupportedControl,
)
from navapp.geometry.rig import StereoRig
from sim_devices.exposure import Shutter, expose
from sim_devices.faults import FaultKind, FaultScript
from sim_devices.rigs import NO_TURN, Turn
from sim_devices.sensor import Eye, Rows, SensorModel

NOMINAL_EXPOSURE_MS = 8.0

_CONTROL_STEP = 0.1
_LARGEST_GAIN_DB = 24.0
# How soon a waiting reader notices that another thread closed the camera.
_LONGEST_WAIT_NS = 20_000_000


class Scene(Protocol):
    """The part of a world that a camera sees."""

    @property
    def rig(self) -> StereoRig:
        """The two cameras at full size."""
        ...

    def render(
        self,
        eye: Eye,
        time_ns: int,
        scale: float = 1.0,
        turn_rad: Turn = NO_TURN,
        rows: Rows | None = None,
    ) -> NDArray[np.float32]:
        """(H, W, 3) float32 BGR radiance at a world time, 1.0 = full well at nominal exposure.

        The right eye is turned about its own axes by the rotation vector `turn_rad`. With `rows`
        only these need be right.
        """
        ...

    def path_px(self, from_ns: int, until_ns: int) -> float:
        """The longest way that anything goes in the left picture (full size) in an interval."""
        ...


class SimulatedCamera:
    """Renders a stereo pair at every exposure instant, a multiple of the frame period.

    The instant is mid exposure of the middle row. With a row delay of the world's rig each row is
    exposed at its own time; with `is_blurred` it gathers light for as long as it is exposed.

    Stepped, `read` takes the instants one by one and moves the clock to each of them. Otherwise the
    camera runs by itself: `read` takes the next instant that is not past, so that a slow reader
    (or a slow computer) misses frames as with a real camera.

    World time 0 and the times of the fault script begin when the camera is opened first; they go
    on while it is closed. A frame is lost for good when nobody takes it.
    """

    def __init__(
        self,
        world: Scene,
        clock: Clock,
        *,
        is_stepped: bool,
        rate_hz: float = 15.0,
        scale: float = 1.0,
        sensor: SensorModel | None = None,
        faults: FaultScript | None = None,
        is_blurred: bool = False,
        skew_ns: int = 0,
        unstamped_skew_ns: int = 0,
        n_frames: int | None = None,
    ) -> None:
        """Set up; nothing is rendered before `open`.

        Args:
            world: what is seen.
            clock: of capture and fault times; a stepped camera moves it.
            is_stepped: whether `read` takes every instant, however late it is called.
            rate_hz: exposure instants in a second.
            scale: of the pictures, against those of the world's rig.
            sensor: of both eyes; its exposure is that of `NOMINAL_EXPOSURE_MS`.
            faults: what goes wrong, none when absent.
            is_blurred: whether what moves during the exposure is blurred.
            skew_ns: how much later the right eye exposes.
            unstamped_skew_ns: how much later it exposes on top of that, unknown to its frames.
            n_frames: the sequence ends after so many, None for never.

        Raises:
            ValueError: a rate or scale that is not positive, or rows that are exposed for longer
                than a frame period.
        """
        if not (rate_hz > 0.0 and scale > 0.0):
            raise ValueError("rate and scale of a camera must be positive")
        rolling_ns = world.rig.row_delay_ns * (world.rig.height - 1)
        if rolling_ns > 0 and rolling_ns + NOMINAL_EXPOSURE_MS * 1e6 > 1e9 / rate_hz:
            raise ValueError("shutter and exposure of a camera must fit into its frame period")
        self._world = world
        self._clock = clock
        self._is_stepped = is_stepped
        self._rate_hz = rate_hz
        self._scale = scale
        self._rig = world.rig if scale == 1.0 else world.rig.scale(scale)
        self._nominal_sensor = sensor or SensorModel()
        self._faults = faults or FaultScript()
        self._is_blurred = is_blurred
        self._skew_ns = skew_ns
        self._true_skew_ns = skew_ns + unstamped_skew_ns
        self._n_frames = n_frames
        self._controls: Mapping[str, float] = MappingProxyType(
            {"exposure_ms": NOMINAL_EXPOSURE_MS, "gain_db": 0.0}
        )
        self._lock = threading.Lock()
        self._origin_ns: int | None = None
        self._opened_ns = 0
        # Counts the openings, odd while open: a reader sees that its opening has ended.
        self._opening = 0
        self._has_other_serials = False
        self._next_instant = 0
        self._sequence = 0
        self._last_frame: StereoFrame | None = None
        self._meter = FrameMeter()

    @property
    def info(self) -> CameraInfo:
        """Identity and measured behaviour."""
        left, right = self._rig.serials
        if self._has_other_serials:
            left, right = f"{left}-other", f"{right}-other"
        return CameraInfo(
            name="sim:stereo camera",
            backend="simulated",
            is_simulated=True,
            is_stepped=self._is_stepped,
            width=self._rig.width,
            height=self._rig.height,
            serials=(left, right),
            measured_rate_hz=self._meter.rate_hz,
            measured_skew_ms=self._meter.skew_ms,
            factory_rig=self._rig,
            n_frames=self._n_frames,
        )

    def open(self) -> None:
        """Start; the first time also starts the world and the fault script.

        Raises:
            DeviceNotFound: it is unplugged.
        """
        with self._lock:
            if self._opening % 2 == 1:
                return
            now_ns = self._clock.now_ns()
            if self._origin_ns is None:
                self._origin_ns = now_ns
            elapsed_ns = now_ns - self._origin_ns
            if self._faults.is_active(FaultKind.UNPLUG, elapsed_ns):
                raise DeviceNotFound(
                    "the simulated camera is unplugged",
                    subject="sim:stereo camera",
                    remedy="wait for the end of this fault in its script",
                )
            self._opened_ns = elapsed_ns
            self._next_instant = max(self._next_instant, self._instant_after(elapsed_ns))
            self._has_other_serials = self._faults.is_active(FaultKind.WRONG_SERIAL, elapsed_ns)
            self._meter = FrameMeter()
            self._opening += 1

    def read(self, timeout_s: float) -> StereoFrame:
        """The next frame.

        Stepped, only a fault lets the time run out: a frame that is due is always handed out.

        Raises:
            DeviceTimeout, DeviceLost, EndOfSequence: see `StereoCamera.read`.
        """
        opening, origin_ns = self._current_opening()
        if self._n_frames is not None and self._sequence >= self._n_frames:
            raise EndOfSequence(f"the simulated sequence ended after {self._n_frames} frames")
        now_ns = self._clock.now_ns() - origin_ns
        patience_ns = max(0, round(timeout_s * 1e9))
        if self._is_stepped:
            patience_ns = max(patience_ns, math.ceil(1e9 / self._rate_hz))
        exposed_ns, due_ns = self._next_exposure(now_ns, now_ns + patience_ns)
        if due_ns > now_ns + patience_ns:
            self._wait_until(now_ns + patience_ns, opening)
            raise DeviceTimeout(
                f"the simulated camera gave no frame within {timeout_s:g} s",
                subject="sim:stereo camera",
                remedy="read again, or wait longer than its frame period",
            )
        frame = self._frame(exposed_ns)
        self._wait_until(due_ns, opening)
        frame = replace(frame, received_ns=self._clock.now_ns())
        self._next_instant += 1
        self._sequence += 1
        self._last_frame = frame
        self._meter.add(frame)
        return frame

    def set(self, control: str, value: float) -> float:
        """Set `exposure_ms` or `gain_db`, in steps of 0.1; both survive a reopening."""
        limits = {
            "exposure_ms": (_CONTROL_STEP, self._longest_exposure_ms),
            "gain_db": (0.0, _LARGEST_GAIN_DB),
        }
        if control not in limits:
            raise UnsupportedControl(
                f"the simulated camera has no control {control!r}",
                subject=control,
                remedy=f"use {' or '.join(limits)}",
            )
        lowest, highest = limits[control]
        if not lowest <= value <= highest:
            raise UnsupportedControl(
                f"the simulated camera cannot set {control} to {value:g}",
                subject=control,
                remedy=f"use {lowest:g} to {highest:g}",
            )
        accepted = round(round(value / _CONTROL_STEP) * _CONTROL_STEP, 6)
        self._controls = MappingProxyType({**self._controls, control: accepted})
        return accepted

    def close(self) -> None:
        """Stop; a reader in another thread gets a `DeviceLost`."""
        with self._lock:
            self._opening += self._opening % 2

    @property
    def _longest_exposure_ms(self) -> float:
        """Beside the shutter's way over the rows."""
        return 1000.0 / self._rate_hz - self._shutter.rolling_ns * 1e-6

    @property
    def _shutter(self) -> Shutter:
        """As the exposure is set now."""
        exposure_ns = round(self._controls["exposure_ms"] * 1e6) if self._is_blurred else 0
        return Shutter(exposure_ns, self._rig.row_delay_ns, self._rig.height)

    def world_time_ns(self, captured_ns: int) -> int:
        """World time of a capture time of the left eye, for a `TruthOracle`.

        Raises:
            DeviceLost: it was never opened.
        """
        if self._origin_ns is None:
            raise _make_closed_error()
        return captured_ns - self._origin_ns

    def _current_opening(self) -> tuple[int, int]:
        with self._lock:
            if self._opening % 2 == 0 or self._origin_ns is None:
                raise _make_closed_error()
            return self._opening, self._origin_ns

    def _next_exposure(self, now_ns: int, limit_ns: int) -> tuple[int, int]:
        """When the next frame is exposed and when it arrives, since the first opening.

        Dropped instants are skipped for good, up to the first one after the limit.
        """
        if not self._is_stepped:
            visible_ns = now_ns - self._faults.delay_ns(now_ns)
            self._next_instant = max(self._next_instant, self._instant_after(visible_ns))
        exposed_ns = self._instant_ns(self._next_instant)
        while exposed_ns <= limit_ns and self._faults.is_active(FaultKind.DROP, exposed_ns):
            self._next_instant += 1
            exposed_ns = self._instant_ns(self._next_instant)
        delay_ns = self._faults.delay_ns(exposed_ns) + max(0, self._true_skew_ns)
        return exposed_ns, exposed_ns + delay_ns + self._shutter.total_ns // 2

    def _instant_ns(self, number: int) -> int:
        return round(number * 1e9 / self._rate_hz)

    def _instant_after(self, elapsed_ns: int) -> int:
        """Number of the first exposure instant that is not before that time."""
        return max(0, math.ceil(elapsed_ns * self._rate_hz / 1e9 - 1e-6))

    def _wait_until(self, elapsed_ns: int, opening: int) -> None:
        """Wait for a time since the first opening.

        Raises:
            DeviceLost: closed meanwhile, or unplugged at any moment since it was opened.
        """
        unplugged_ns = self._faults.first_moment_ns(
            FaultKind.UNPLUG, self._opened_ns, max(elapsed_ns, self._compute_elapsed_ns(opening))
        )
        while True:
            now_ns = self._compute_elapsed_ns(opening)
            if unplugged_ns is not None and now_ns >= unplugged_ns:
                raise DeviceLost(
                    "the simulated camera was unplugged",
                    subject="sim:stereo camera",
                    remedy="close it and open it again",
                )
            if now_ns >= elapsed_ns:
                return
            next_ns = min(elapsed_ns, now_ns + _LONGEST_WAIT_NS)
            if unplugged_ns is not None:
                next_ns = min(next_ns, unplugged_ns)
            self._clock.wait_until_ns(self._clock.now_ns() - now_ns + next_ns)

    def _compute_elapsed_ns(self, opening: int) -> int:
        current, origin_ns = self._current_opening()
        if current != opening:
            raise _make_closed_error()
        return self._clock.now_ns() - origin_ns

    def _frame(self, exposed_ns: int) -> StereoFrame:
        """What the driver has of the exposure at that time; the time of receipt comes later."""
        if self._last_frame is not None and self._faults.is_active(FaultKind.FREEZE, exposed_ns):
            return replace(self._last_frame, sequence=self._sequence)
        captured_ns = exposed_ns + (self._origin_ns or 0)
        return StereoFrame(
            left=self._picture("left", exposed_ns),
            right=self._picture("right", max(0, exposed_ns + self._true_skew_ns)),
            captured_ns=captured_ns,
            received_ns=captured_ns,
            skew_ns=self._skew_ns,
            sequence=self._sequence,
            rig_id=self._rig.rig_id,
            row_delay_ns=self._rig.row_delay_ns,
        )

    def _picture(self, eye: Eye, world_time_ns: int) -> Image:
        blackout = FaultKind.BLACKOUT_LEFT if eye == "left" else FaultKind.BLACKOUT_RIGHT
        if self._faults.is_active(blackout, world_time_ns):
            radiance = np.zeros((self._rig.height, self._rig.width, 3), np.float32)
        else:
            radiance = self._radiance(eye, world_time_ns)
        controls = self._controls
        sensor = self._nominal_sensor.with_exposure(
            controls["exposure_ms"] / NOMINAL_EXPOSURE_MS, controls["gain_db"]
        )
        return sensor.picture(radiance, eye, self._sequence)

    def _radiance(self, eye: Eye, middle_ns: int) -> NDArray[np.float32]:
        """Of the picture of which the middle row is at mid exposure then."""
        turn_rad, shutter = self._faults.turn_rad(middle_ns), self._shutter
        if shutter.total_ns == 0:
            return self._world.render(eye, middle_ns, self._scale, turn_rad)

        def render(time_ns: int, rows: Rows | None) -> NDArray[np.float32]:
            return self._world.render(eye, time_ns, self._scale, turn_rad, rows)

        half_ns = shutter.total_ns // 2
        path_px = self._scale * self._world.path_px(middle_ns - half_ns, middle_ns + half_ns)
        return expose(render, shutter, path_px, middle_ns)


def _make_closed_error() -> DeviceLost:
    return DeviceLost(
        "the simulated camera is not open",
        subject="sim:stereo camera",
        remedy="open it before reading",
    )
