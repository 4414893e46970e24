"""Serial ports with the names that stay; none is opened, since that may reset what is behind it."""

import os
from dataclasses import dataclass
from pathlib import Path

from drivers.discovery.listing import Listing, Unseen
from drivers.discovery.permissions import make_permission_remedy, may_use

_LINKS = Path("/dev/serial")
_TTYS = Path("/sys/class/tty")
# A port that the kernel reserved, with no chip behind it.
_NO_CHIP = "0"


@dataclass(frozen=True, slots=True)
class FoundPort:
    """A serial port."""

    device: str  # its device file, whose number may change
    path: str  # what `port` under `[projector]` and `[mirror]` takes: a name that stays
    description: str  # of the adapter, for people
    maker: str  # of a USB adapter, as it says itself; else empty
    usb_serial: str  # serial number of a USB adapter, not of the device behind it; else empty


def list_serial_ports(links: Path = _LINKS, ttys: Path = _TTYS) -> Listing[FoundPort]:
    """USB adapters, and built-in ports with a chip.

    Args:
        links: folder with `by-id` and `by-path`.
        ttys: folder with a folder for every terminal device.
    """
    try:
        from serial.tools.list_ports import comports
    except ImportError as error:
        problem = f"serial ports need the package pyserial ({error})"
        return Listing((), (Unseen("pyserial", problem, "install pyserial"),))
    ports, unseen = [], []
    for port in sorted(comports(), key=lambda port: str(port.device)):
        if port.vid is None and _has_no_chip(ttys / Path(port.device).name):
            continue
        ports.append(
            FoundPort(
                port.device,
                _lasting_name(port.device, links),
                port.description if port.description not in (None, "n/a") else "built-in port",
                port.manufacturer or "",
                port.serial_number or "",
            )
        )
        if not may_use(Path(port.device)):
            unseen.append(_forbidden(Path(port.device)))
    return Listing(tuple(ports), tuple(unseen))


def _has_no_chip(tty: Path) -> bool:
    try:
        return (tty / "type").read_text(encoding="ascii").strip() == _NO_CHIP
    except OSError:
        return False


def _lasting_name(device: str, links: Path) -> str:
    """Below by-id, else by-path; a built-in port has none, and keeps its number."""
    for folder in ("by-id", "by-path"):
        for link in sorted((links / folder).glob("*")):
            if os.path.realpath(link) == os.path.realpath(device):
                return str(link)
    return device


def _forbidden(device: Path) -> Unseen:
    problem = f"this user may not open the port {device}"
    return Unseen(str(device), problem, make_permission_remedy(device, "dialout"))
