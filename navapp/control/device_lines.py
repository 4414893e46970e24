"""What the devices panel says of camera, display and rig."""

from drivers.interfaces import CameraInfo, DisplayInfo
from navapp.control.length_check import LengthCheck
from navapp.control.states import DeviceHealth, DeviceLine


def camera_line(info: CameraInfo, trouble: str) -> DeviceLine:
    """The stereo camera."""
    rate = "" if info.measured_rate_hz is None else f" {info.measured_rate_hz:.0f} Hz"
    health = DeviceHealth.LOST if trouble else DeviceHealth.OK
    return DeviceLine("camera", info.name, health, trouble or f"{info.width}x{info.height}{rate}")


def display_line(info: DisplayInfo, trouble: str) -> DeviceLine:
    """The display."""
    health = DeviceHealth.TROUBLE if trouble else DeviceHealth.OK
    return DeviceLine("display", info.name, health, trouble or f"{info.width}x{info.height}")


def rig_line(name: str, problem: str, check: LengthCheck | None, now_ns: int) -> DeviceLine:
    """The rig itself: what is wrong with it, or what a known length in view said of it last."""
    if problem:
        return DeviceLine("rig", name, DeviceHealth.TROUBLE, problem)
    if check is None:
        return DeviceLine("rig", name, DeviceHealth.OK, "not checked: show the board")
    is_doubted = check.is_judged and not check.is_within
    health = DeviceHealth.TROUBLE if is_doubted else DeviceHealth.OK
    age_s = max(now_ns - check.captured_ns, 0) // 1_000_000_000
    return DeviceLine("rig", name, health, f"{check}, {age_s} s ago")
