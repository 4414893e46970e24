"""A stereo camera for navapp: a striped wall at a fixed distance, drawn instead of photographed.

What a driver has to do is all here; replace the drawing by what your camera sends. The protocol
is `StereoCamera` in `drivers/interfaces.py`, what it demands is tested by `drivers.contracts`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from drivers.clock import Clock
from drivers.frames import FrameMeter, Image, StereoFrame
from drivers.interfaces import CameraInfo, StereoCamera
from navapp.errors import DeviceLost, DeviceTimeout, UnsupportedControl, UsageError

WIDTH, HEIGHT = 64, 48
STRIPE_PX, DISPARITY_PX = 8, 5
NAME = "sim:example camera"  # the name of a camera whose pictures are not real begins so


def make(settings: Mapping[str, Any], clock: Clock) -> StereoCamera:
    """What the entry point names: a camera, not opened yet.

    Args:
        settings: the table `[camera.example]`, which navapp has not checked.
        clock: of every time stamp.
    """
    unknown = set(settings) - {"rate_hz"}
    rate_hz = settings.get("rate_hz", 30.0)
    if unknown or not isinstance(rate_hz, int | float) or not 1.0 <= rate_hz <= 120.0:
        raise UsageError(
            f"[camera.example] is not understood: {dict(settings)}",
            subject="camera.example",
            remedy="it takes rate_hz, 1 to 120",
        )
    return ExampleCamera(float(rate_hz), clock)


class ExampleCamera:
    """Free-running: it exposes at every multiple of its period, whether somebody reads or not."""

    def __init__(self, rate_hz: float, clock: Clock) -> None:
        self._period_ns = round(1e9 / rate_hz)
        self._clock = clock
        self._exposure_ms = 5.0
        self._is_open = False
        self._exposed_ns = 0  # when the last frame was taken
        self._sequence = 0
        self._meter = FrameMeter()

    @property
    def info(self) -> CameraInfo:
        """Never fails, also before `open`; a rig is bound to the serial numbers told here."""
        return CameraInfo(
            name=NAME,
            backend="example",
            is_simulated=True,
            is_stepped=False,
            width=WIDTH,
            height=HEIGHT,
            serials=("EX-L", "EX-R"),
            measured_rate_hz=self._meter.rate_hz,
            measured_skew_ms=self._meter.skew_ms,
            controls={"exposure_ms": self._exposure_ms},
        )

    def open(self) -> None:
        """Connect; DeviceNotFound when it is not there, WrongDevice when it is another one."""
        if not self._is_open:
            self._is_open, self._meter = True, FrameMeter()

    def read(self, timeout_s: float) -> StereoFrame:
        """Wait for the next pair, newer than the last; an old one is worse than none."""
        if not self._is_open:
            raise DeviceLost(f"{NAME} is not open", subject=NAME, remedy="open it first")
        now_ns = self._clock.now_ns()
        due_ns = (max(now_ns, self._exposed_ns) // self._period_ns + 1) * self._period_ns
        end_ns = now_ns + round(timeout_s * 1e9)
        self._clock.wait_until_ns(min(due_ns, end_ns))
        if due_ns > end_ns:
            raise DeviceTimeout(f"{NAME} gave no pair within {timeout_s:g} s", subject=NAME)
        self._exposed_ns = due_ns
        self._sequence += 1
        frame = StereoFrame(
            left=_wall(0),
            right=_wall(DISPARITY_PX),
            captured_ns=due_ns,  # mid exposure of the left picture, on navapp's clock
            received_ns=self._clock.now_ns(),
            skew_ns=0,  # how much later the right eye exposed
            sequence=self._sequence,
            rig_id="",
        )
        self._meter.add(frame)
        return frame

    def set(self, control: str, value: float) -> float:
        """Set a control and return what the camera then has, which may be its nearest step."""
        if control != "exposure_ms" or not 0.1 <= value <= 20.0:
            raise UnsupportedControl(
                f"{NAME} cannot set {control} to {value:g}",
                subject=control,
                remedy="it has exposure_ms, 0.1 to 20",
            )
        self._exposure_ms = round(value, 1)
        return self._exposure_ms

    def close(self) -> None:
        """Release everything; works twice and from any state."""
        self._is_open = False


def _wall(shift_px: int) -> Image:
    """(HEIGHT, WIDTH) grey: stripes that the right eye sees further to the left."""
    columns = (np.arange(WIDTH) + shift_px) // STRIPE_PX % 2
    return np.tile(np.where(columns, 200, 40).astype(np.uint8), (HEIGHT, 1))
