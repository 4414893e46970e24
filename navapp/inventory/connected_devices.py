"""Lists all connected devices, and makes the TOML that chooses each."""

from collections.abc import Iterator
from dataclasses import dataclass

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

# What a serial port may lead to: in words, table, backend.
_PORT_USES = (
    ("a projector that speaks ESC/VP21 (Epson)", "projector", "escvp21"),
    ("the mirror's rotary stage, if it speaks Zaber's ASCII protocol", "mirror", "zaber"),
)

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
    """TOML that chooses a device; empty when it cannot be chosen.

    Of a serial port every use is a comment: what is behind its adapter is not known, as asking
    would disturb it.
    """
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
            return "\n".join(_port_uses(path))
        case Output(name=name, width=width, height=height):
            return format_table(
                "display", {"backend": "window", "output": name, "size_px": (width, height)}
            )


def _port_uses(path: str) -> Iterator[str]:
    yield "# what is behind it is not known; where it is one of these, take its lines"
    for words, table, backend in _PORT_USES:
        yield f"## {words}:"
        for line in format_table(table, {"backend": backend, "port": path}).splitlines():
            yield f"# {line}"


def _camera(backend: str) -> str:
    return format_table("camera", {"backend": backend})
