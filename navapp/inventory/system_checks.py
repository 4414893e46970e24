"""Checks what devices need of the system: groups, a udev rule, libraries, a screen.

A check says nothing of a kind of device that is neither connected nor configured.
"""

import ctypes
import os
from collections.abc import Sequence
from pathlib import Path

from drivers.discovery.oak_cameras import UDEV_REMEDY, list_oak_nodes
from drivers.discovery.permissions import (
    is_member,
    make_group_remedy,
    make_permission_remedy,
    may_use,
)
from navapp.config import Configuration
from navapp.inventory.connected_devices import Inventory
from navapp.inventory.finding import Finding, Health, judge_health

# SDL's X11 driver loads them by these names when it starts.
_WINDOW_LIBRARIES = (
    "libX11.so.6", "libXext.so.6", "libXcursor.so.1", "libXi.so.6", "libXrandr.so.2", "libXss.so.1",
    "libXfixes.so.3",
)  # fmt: skip
# DepthAI brings its own; Open3D does not.
_OPEN3D_LIBRARIES = ("libusb-1.0.so.0", "libgomp.so.1", "libGL.so.1")
_RULE_FOLDERS = tuple(
    Path(folder) / "udev/rules.d" for folder in ("/etc", "/run", "/usr/lib", "/lib")
)


def check_system(configuration: Configuration, found: Inventory) -> list[Finding]:
    """Every check that applies."""
    is_usb = configuration.camera.backend == "opencv"
    cameras = [camera.node for camera in found.usb_cameras.found]
    ports = [Path(port.device) for port in found.serial_ports.found]
    is_window = configuration.display.backend != "simulated"
    return [
        *_group("video", "USB cameras", cameras, is_usb),
        *_group("dialout", "serial ports", ports, _has_local_port(configuration)),
        *_udev_rule(list_oak_nodes(), configuration.camera.backend == "depthai"),
        _libraries("window libraries", _WINDOW_LIBRARIES, is_window),
        _libraries("open3d libraries", _OPEN3D_LIBRARIES, False),
        _display_server(found, is_window),
    ]


def _has_local_port(configuration: Configuration) -> bool:
    projector, mirror = configuration.projector, configuration.mirror
    used = [
        (projector.backend == "escvp21", projector.port),
        (mirror.backend == "zaber", mirror.port),
    ]
    return any(is_used and "://" not in port for is_used, port in used)


def _group(group: str, devices: str, nodes: Sequence[Path], is_configured: bool) -> list[Finding]:
    """Whether this user may open what is connected, through the group or otherwise.

    Of the configured devices themselves another check says so, and fails.
    """
    nodes = [node for node in nodes if node.exists()]
    name = f"group {group}"
    if not nodes and not is_configured:
        return []
    if os.geteuid() == 0:
        return [Finding(name, Health.OK, f"root may open all {devices}")]
    forbidden = [node for node in nodes if not may_use(node)]
    if forbidden:
        listed = ", ".join(map(str, forbidden))
        detail = f"this user may not open {listed} ({devices})"
        return [Finding(name, Health.WARNING, detail, make_permission_remedy(forbidden[0], group))]
    if nodes:
        return [Finding(name, Health.OK, f"this user may open the connected {devices}")]
    detail = f"{devices} are configured and none is connected; this user is "
    if is_member(group):
        return [Finding(name, Health.OK, f"{detail}in the group")]
    return [Finding(name, Health.WARNING, f"{detail}not in the group", make_group_remedy(group))]


def _udev_rule(nodes: Sequence[Path], is_configured: bool) -> list[Finding]:
    """Whether OAK cameras may be opened: seen on the camera itself, else from the rules."""
    if not nodes and not is_configured:
        return []
    name = "udev rule for OAK"
    if os.geteuid() == 0:
        return [Finding(name, Health.OK, "root needs none")]
    forbidden = [node for node in nodes if not may_use(node)]
    if forbidden:
        detail = f"this user may not use the camera at {', '.join(map(str, forbidden))}"
        return [Finding(name, Health.WARNING, detail, UDEV_REMEDY)]
    if nodes:
        return [Finding(name, Health.OK, "this user may use the connected camera")]
    rules = [path for folder in _RULE_FOLDERS for path in sorted(folder.glob("*.rules"))]
    for path in rules:
        if "03e7" in _content(path):
            return [Finding(name, Health.OK, f"{path} names the vendor 03e7")]
    detail = "no rule names the vendor 03e7, and no camera is connected to try"
    return [Finding(name, Health.WARNING, detail, UDEV_REMEDY)]


def _content(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _libraries(name: str, libraries: Sequence[str], is_needed: bool) -> Finding:
    missing = [library for library in libraries if not _loads(library)]
    if missing:
        detail = f"missing: {', '.join(missing)}"
        return Finding(name, judge_health(False, is_needed), detail, "run `make system-deps`")
    return Finding(name, Health.OK, f"{len(libraries)} found")


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _display_server(found: Inventory, is_needed: bool) -> Finding:
    if found.displays.found:
        listed = ", ".join(map(str, found.displays.found))
        return Finding("display server", Health.OK, f"X11 shows {listed}")
    (why,) = found.displays.unseen
    return Finding("display server", judge_health(False, is_needed), why.problem, why.remedy)
