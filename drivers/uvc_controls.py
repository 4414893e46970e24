"""Sets format and controls of a USB camera through OpenCV and verifies them by reading back.

OpenCV's `set` returns True even when the camera takes something else: what is read back counts.
"""

import math
from dataclasses import dataclass
from typing import Any, Protocol

import cv2

from drivers.uvc_settings import UvcSettings
from navapp.errors import DeviceError, UnsupportedControl

# OpenCV's answer for a property that the camera does not have.
_ABSENT = -1.0
# The fields of UVC controls have 16 bits; exposure has more, but is bounded by the frame period.
_HIGHEST_RAW = 65535.0
# A camera has its own steps of a control; what is farther from the wish was refused.
_NEARNESS = 0.1
_RATE_NEARNESS = 0.02


class Capture(Protocol):
    """The part of `cv2.VideoCapture` that the driver uses: the lowest seam for a fake."""

    def isOpened(self) -> bool:  # noqa: N802 (OpenCV's name)
        """Whether it was opened; stays True after an unplug."""
        ...

    def set(self, propId: int, value: float, /) -> bool:
        """Ask for a property."""
        ...

    def get(self, propId: int, /) -> float:
        """Read a property back; -1 when there is none."""
        ...

    def grab(self) -> bool:
        """Wait for the next picture."""
        ...

    def retrieve(self) -> tuple[bool, Any]:
        """Decode the grabbed picture into an array of its own."""
        ...

    def release(self) -> None:
        """Give the device back."""
        ...


@dataclass(frozen=True, slots=True)
class _Control:
    """A control, the switch of its automatic, and that switch's position for manual."""

    property_id: int
    raw_per_unit: float = 1.0
    switch_id: int | None = None
    manual: float = 0.0


_CONTROLS = {
    # V4L2 counts exposure in 0.1 ms; of its menu of automatics 1 is manual.
    "exposure_ms": _Control(cv2.CAP_PROP_EXPOSURE, 10.0, cv2.CAP_PROP_AUTO_EXPOSURE, 1.0),
    "gain": _Control(cv2.CAP_PROP_GAIN),
    "white_balance_k": _Control(cv2.CAP_PROP_WB_TEMPERATURE, 1.0, cv2.CAP_PROP_AUTO_WB),
    "focus": _Control(cv2.CAP_PROP_FOCUS, 1.0, cv2.CAP_PROP_AUTOFOCUS),
}


def set_format(capture: Capture, settings: UvcSettings, name: str) -> int:
    """Ask for pixel format, size, rate and a buffer of one, in the order that V4L2 needs.

    Returns:
        How many pictures the driver keeps; some keep more than one, so ages are checked as well.

    Raises:
        DeviceError: the camera has another format, size or rate.
    """
    wishes = (
        (cv2.CAP_PROP_MODE, 0.0),  # true units, not OpenCV's own of 0 to 1
        (cv2.CAP_PROP_FOURCC, float(cv2.VideoWriter.fourcc(*settings.fourcc))),
        (cv2.CAP_PROP_FRAME_WIDTH, float(settings.width)),
        (cv2.CAP_PROP_FRAME_HEIGHT, float(settings.height)),
        (cv2.CAP_PROP_FPS, settings.rate_hz),
        (cv2.CAP_PROP_BUFFERSIZE, 1.0),
    )
    for property_id, value in wishes:
        capture.set(property_id, value)
    has = [capture.get(property_id) for property_id, _ in wishes]
    rate_hz = has[4]
    is_same = all(got == value for got, (_, value) in zip(has[1:4], wishes[1:4], strict=True))
    if not is_same or abs(rate_hz - settings.rate_hz) > _RATE_NEARNESS * settings.rate_hz:
        raise DeviceError(
            f"camera {name} has {_text(has[1])} {has[2]:g}x{has[3]:g} at {rate_hz:g} Hz where "
            f"{settings.fourcc} {settings.width}x{settings.height} at {settings.rate_hz:g} Hz "
            "was asked for",
            subject=name,
            remedy="ask for a format, size and rate that it offers",
        )
    if has[0] != 0.0:
        raise DeviceError(
            f"camera {name} does not tell its controls in true units",
            subject=name,
            remedy="unset OPENCV_VIDEOIO_V4L_RANGE_NORMALIZED",
        )
    return int(has[5])


def lock_controls(capture: Capture, settings: UvcSettings, name: str) -> dict[str, float]:
    """Switch every automatic off, set what is asked for, and tell what the camera has then.

    Raises:
        DeviceError: an automatic stays on.
        UnsupportedControl: a control is missing, or the camera took another value.
    """
    for control_name, control in _CONTROLS.items():
        if control.switch_id is None or capture.get(control.switch_id) == _ABSENT:
            continue
        capture.set(control.switch_id, control.manual)
        if capture.get(control.switch_id) != control.manual:
            raise DeviceError(
                f"camera {name} keeps its automatic for {control_name}",
                subject=name,
                remedy="use a camera whose pictures do not change by themselves",
            )
    for control_name, wish in settings.controls.items():
        set_control(capture, control_name, wish, settings.rate_hz, name)
    return read_controls(capture)


def set_control(
    capture: Capture, control_name: str, value: float, rate_hz: float, name: str
) -> float:
    """Ask for a control and return what the camera says it has, in the same unit.

    Raises:
        UnsupportedControl: no such control, a value that no camera can take, or the camera took
            another one.
    """
    check_control(control_name, value, rate_hz)
    control = _CONTROLS[control_name]
    if capture.get(control.property_id) == _ABSENT:
        raise UnsupportedControl(
            f"camera {name} has no control {control_name}",
            subject=control_name,
            remedy="leave it out of the configuration",
        )
    capture.set(control.property_id, float(round(value * control.raw_per_unit)))
    has = capture.get(control.property_id) / control.raw_per_unit
    if abs(has - value) > _NEARNESS * abs(value):
        raise UnsupportedControl(
            f"camera {name} was asked for {control_name} {value:g} and has {has:g}",
            subject=control_name,
            remedy="ask for a value that it can take",
        )
    return has


def check_control(control_name: str, value: float, rate_hz: float) -> None:
    """Refuse what no camera has.

    Raises:
        UnsupportedControl: see `set_control`.
    """
    control = _CONTROLS.get(control_name)
    if control is None:
        raise UnsupportedControl(
            f"a USB camera has no control {control_name!r}",
            subject=control_name,
            remedy=f"use {', '.join(_CONTROLS)}",
        )
    is_exposure = control_name == "exposure_ms"
    lowest = 1.0 / control.raw_per_unit if is_exposure else 0.0
    highest = 1000.0 / rate_hz if is_exposure else _HIGHEST_RAW
    if not (math.isfinite(value) and lowest <= value <= highest):
        raise UnsupportedControl(
            f"{control_name} cannot be {value:g}",
            subject=control_name,
            remedy=f"use {lowest:g} to {highest:g}",
        )


def read_controls(capture: Capture) -> dict[str, float]:
    """Every control that the camera has, as it tells it."""
    raw = {name: capture.get(control.property_id) for name, control in _CONTROLS.items()}
    return {
        name: value / _CONTROLS[name].raw_per_unit
        for name, value in raw.items()
        if value != _ABSENT
    }


def _text(fourcc: float) -> str:
    code = int(fourcc) & 0xFFFFFFFF
    return "".join(chr((code >> shift) & 0xFF) for shift in (0, 8, 16, 24))
