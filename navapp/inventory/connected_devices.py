"""Lists all connected devices, and makes the TOML that chooses each."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drivers.discovery import (
    FoundPort,
    Listing,
    OakCamera,
    UsbCamera,
    list_oak_cameras,
    list_screens,
    list_serial_ports,
    list_usb_cameras,
)
from drivers.v4l_names import V4lNames
from drivers.window_outputs import Output
from navapp.config import format_table
from navapp.inventory.camera_packages import InstalledCamera, list_installed

Device = UsbCamera | OakCamera | InstalledCamera | FoundPort | Output


@dataclass(frozen=True, slots=True)
class Inventory:
    """All devices that were found connected."""

    usb_cameras: Listing[UsbCamera]
    oak_cameras: Listing[OakCamera]
    installed_cameras: Listing[InstalledCamera]
    serial_ports: Listing[FoundPort]
    displays: Listing[Output]


def list_all_devices(names: V4lNames | None = None) -> Inventory:
    """Look; nothing is streamed, booted, moved or sent.

    Args:
        names: where USB cameras are looked up.
    """
    return Inventory(
        list_usb_cameras(names or V4lNames()),
        list_oak_cameras(),
        list_installed(),
        list_serial_ports(),
        list_screens(),
    )


def make_choice_toml(device: Device) -> str:
    """TOML that chooses a device; empty when it cannot be chosen."""
    match device:
        case UsbCamera(chosen_by=""):
            return ""
        case UsbCamera(chosen_by=name):
            eye = format_table("camera.opencv", {"left": name})
            other = format_table("camera.opencv", {"right": name}).splitlines()[1]
            return f"{_camera('opencv')}\n{eye}\n# {other}"
        case OakCamera(device_id=name):
            return f"{_camera('depthai')}\n{format_table('camera.depthai', {'device': name})}"
        case InstalledCamera(backend=name):
            return _camera(name)
        case FoundPort(path=path):
            keys: Mapping[str, Any] = {"backend": "escvp21", "port": path}
            return f'{format_table("projector", keys)}\n# or [mirror] with backend = "zaber"'
        case Output(name=name, width=width, height=height):
            keys = {"backend": "window", "output": name, "size_px": (width, height)}
            return format_table("display", keys)


def _camera(backend: str) -> str:
    return format_table("camera", {"backend": backend})
