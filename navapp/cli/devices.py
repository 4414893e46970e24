"""`navapp devices`: what is connected, and how the configuration chooses it."""

import argparse
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json

if TYPE_CHECKING:
    from drivers.discovery import PixelFormat, Unseen
    from navapp.inventory.connected_devices import Device, Inventory

_TITLES = {
    "usb_cameras": "USB cameras",
    "oak_cameras": "OAK cameras",
    "installed_cameras": "Cameras of installed packages",
    "serial_ports": "Serial ports",
    "displays": "Monitors and projectors",
}
_INDENT = " " * 12


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "devices",
        help="cameras, serial ports, monitors: what is connected, and how to choose it",
        description="List what is connected, each with the lines that choose it in navapp.toml. "
        "Nothing is streamed, booted, moved or sent: a running session is not disturbed.",
        epilog="example: navapp devices",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it; that nothing is connected is an answer, too."""
    from navapp.inventory.connected_devices import list_all_devices

    check_writable(options.json)
    found = list_all_devices()
    write_json(options.json, "devices", to_json(found))
    if options.json != "-":
        diagnostics.say(format_text(found))
    return 0


def to_json(found: "Inventory") -> dict[str, Any]:
    """A list for each kind of device, and `unseen`: what could not be looked at."""
    content: dict[str, Any] = {
        kind: [_device_to_json(device) for device in getattr(found, kind).found] for kind in _TITLES
    }
    content["unseen"] = [
        {"kind": kind, **asdict(one)} for kind in _TITLES for one in getattr(found, kind).unseen
    ]
    return content


def format_text(found: "Inventory") -> str:
    """The same for people: what chooses a device stands below it, to be copied."""
    paragraphs = []
    for kind, title in _TITLES.items():
        listing = getattr(found, kind)
        lines = [title if listing.found else f"{title}: none seen"]
        for device in listing.found:
            lines += ["", *_device_text(device)]
        lines += [line for one in listing.unseen for line in ["", *_unseen_text(one)]]
        paragraphs.append("\n".join(lines))
    return "\n\n".join(paragraphs)


def _device_to_json(device: "Device") -> dict[str, Any]:
    from navapp.inventory.connected_devices import make_choice_toml

    keys = {
        key: os.fspath(value) if isinstance(value, Path) else value
        for key, value in asdict(device).items()
    }
    return {**keys, "configuration": make_choice_toml(device) or None}


def _device_text(device: "Device") -> Iterator[str]:
    from navapp.inventory.connected_devices import make_choice_toml

    name, facts = _facts(device)
    yield f"  {name}"
    for label, lines in facts:
        yield from _label_lines(label, lines)
    yield from _label_lines("choose", make_choice_toml(device).splitlines())


def _facts(device: "Device") -> tuple[str, list[tuple[str, Sequence[str]]]]:
    """A device's name for people, and what else is known of it."""
    from drivers.discovery import FoundPort, OakCamera, UsbCamera
    from navapp.inventory.camera_packages import InstalledCamera

    match device:
        case UsbCamera():
            name = f"{device.card or 'camera'}, {_serial_text(device.serial)}"
            paths = [str(path) for path in (device.node, device.path) if path]
            return name, [("device", paths), ("formats", _formats_text(device.formats))]
        case OakCamera():
            use = ["in use, or restarting"] if device.is_in_use else []
            return device.device_id, [("USB port", [device.port]), ("state", use)]
        case InstalledCamera():
            return device.backend, [("package", [device.package]), ("factory", [device.factory])]
        case FoundPort():
            serial = f", {_serial_text(device.usb_serial)}" if device.usb_serial else ""
            paths = list(dict.fromkeys((device.device, device.path)))
            makers = [device.maker] if device.maker else []
            return f"{device.description}{serial}", [("port", paths), ("maker", makers)]
        case _:
            size = f"{device.width}x{device.height} at +{device.left}+{device.top}"
            return device.name, [("size", [size])]


def _serial_text(serial: str) -> str:
    return f"serial number {serial}" if serial else "without a serial number"


def _formats_text(formats: Sequence["PixelFormat"]) -> list[str]:
    """A line for each pixel format and set of rates."""
    lines = []
    for one in formats:
        by_rates: dict[tuple[float, ...], list[str]] = {}
        for size in one.sizes:
            by_rates.setdefault(size.rates_hz, []).append(f"{size.width}x{size.height}")
        for rates_hz, sizes in by_rates.items():
            rates = " at " + ", ".join(f"{rate:g}" for rate in rates_hz) + " Hz" if rates_hz else ""
            lines.append(f"{one.fourcc} {', '.join(sizes)}{rates}")
    return lines


def _unseen_text(one: "Unseen") -> Iterator[str]:
    yield f"  ! {one.problem}"
    yield f"    -> {one.remedy}"


def _label_lines(label: str, lines: Sequence[str]) -> Iterator[str]:
    for number, line in enumerate(lines):
        yield f"    {label:<{len(_INDENT) - 4}} {line}" if number == 0 else f"{_INDENT} {line}"
