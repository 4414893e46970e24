"""What the devices panel says of camera, display and rig."""

from dataclasses import replace

from drivers.interfaces import CameraInfo, DisplayInfo
from navapp.control.length_check import Finding, LengthCheck
from navapp.control.states import DeviceHealth, DeviceLine
from navapp.values import Reason

# What is not known is no good news.
_FINDINGS = {
    Finding.OFF: DeviceHealth.TROUBLE,
    Finding.DOUBTFUL: DeviceHealth.TROUBLE,
    Finding.WITHIN: DeviceHealth.OK,
    Finding.NOT_JUDGED: DeviceHealth.UNKNOWN,
}


# What helps a device in trouble that names nothing better itself.
_REMEDIES = {
    "camera": f"{Reason.CAMERA_SILENT.remedy}; it is opened again by itself, at once with o",
    "display": "check its cable and its mains; it is opened again by itself",
    "projector": f"{Reason.PROJECTOR_LOST.remedy}; it is opened again by itself, at once with o",
    "mirror": "o brings it back to its place; keep hands off meanwhile",
    "rig": Reason.RIG_MOVED.remedy,
    "recording": "free room on that disc; what is kept so far can be replayed",
}


def with_remedy(line: DeviceLine) -> DeviceLine:
    """The line of a device in trouble says what to do."""
    if line.remedy or line.health not in (DeviceHealth.TROUBLE, DeviceHealth.LOST):
        return line
    return replace(line, remedy=_REMEDIES.get(line.kind, ""))


def camera_line(info: CameraInfo, trouble: str, silence: str) -> DeviceLine:
    """The stereo camera: why it is lost, or why it is silent, else what it sends."""
    if silence and not trouble:
        return DeviceLine("camera", info.name, DeviceHealth.TROUBLE, silence)
    rate = "" if info.measured_rate_hz is None else f" {info.measured_rate_hz:.0f} Hz"
    health = DeviceHealth.LOST if trouble else DeviceHealth.OK
    return DeviceLine("camera", info.name, health, trouble or f"{info.width}x{info.height}{rate}")


def display_line(info: DisplayInfo, trouble: str) -> DeviceLine:
    """The display."""
    health = DeviceHealth.TROUBLE if trouble else DeviceHealth.OK
    return DeviceLine("display", info.name, health, trouble or f"{info.width}x{info.height}")


def rig_line(
    name: str,
    problem: str,
    check: LengthCheck | None,
    now_ns: int,
    unjudged: LengthCheck | None = None,
) -> DeviceLine:
    """The rig itself: what is wrong with it, or what a known length in view said of it last.

    Args:
        name: of the rig.
        problem: why it is not believed any more; empty while it is.
        check: the newest that says something, else the newest; None before one.
        now_ns: the session's time.
        unjudged: the newest, as long as it says nothing.
    """
    if problem:
        return DeviceLine("rig", name, DeviceHealth.TROUBLE, problem)
    if check is None:
        return DeviceLine("rig", name, DeviceHealth.UNKNOWN, "not checked: show the board")
    told = f"{check}, {max(now_ns - check.captured_ns, 0) // 1_000_000_000} s ago"
    if unjudged is not None and unjudged is not check:
        told = f"{told}; now {unjudged}"
    return DeviceLine("rig", name, _FINDINGS[check.finding], told)
