"""Lists the USB cameras of this computer, each with the name that a configuration takes."""

import errno
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from drivers.discovery.listing import Listing, Unseen
from drivers.discovery.permissions import make_permission_remedy
from drivers.discovery.v4l_formats import PixelFormat, VideoDevice, ask
from drivers.v4l_names import FoundCamera, V4lNames


@dataclass(frozen=True, slots=True)
class UsbCamera:
    """A camera behind V4L2."""

    node: Path  # its device file, whose number changes
    path: Path | None  # the name of that file that stays; None where the system gives it none
    # what `[camera.opencv] left` takes: its serial number where no other camera has the same, else
    # the path of its port; empty when there is neither.
    chosen_by: str
    serial: str  # as it tells it; empty when it does not
    card: str  # its name for people; empty when it could not be asked
    formats: tuple[PixelFormat, ...]  # empty when it could not be asked


def list_usb_cameras(names: V4lNames | None = None) -> Listing[UsbCamera]:
    """Every camera once; what keeps one from being asked or chosen is told beside it."""
    names = names or V4lNames()
    named = {camera.node: camera for camera in names.list_cameras()}
    counts = Counter(camera.serial for camera in named.values())
    cameras: list[UsbCamera] = []
    unseen: list[Unseen] = []
    for node in sorted({*named, *names.nodes()}, key=_number):
        camera = named.get(node)
        try:
            device = ask(node)
        except OSError as error:
            unseen.append(_make_unasked(node, error))
            device = VideoDevice(names.card(node), is_camera=True, formats=())
        if not device.is_camera:
            continue
        chosen_by = _find_choice(camera, counts, names)
        if not chosen_by:
            unseen.append(_make_unnamed(node, names))
        path = None if camera is None else camera.path
        serial = names.serial(node)
        cameras.append(UsbCamera(node, path, chosen_by, serial, device.card, device.formats))
    return Listing(tuple(cameras), tuple(unseen))


def _find_choice(camera: FoundCamera | None, counts: Counter[str], names: V4lNames) -> str:
    if camera is None:
        return ""
    if counts[camera.serial] == 1:
        return camera.serial
    # Cameras of one serial number share one name in by-id: only their ports tell them apart.
    port = names.port(camera.node)
    return "" if port is None else str(port)


def _number(node: Path) -> tuple[int, str]:
    digits = "".join(letter for letter in node.name if letter.isdigit())
    return int(digits or 0), node.name


def _make_unasked(node: Path, error: OSError) -> Unseen:
    remedies = {
        errno.EACCES: make_permission_remedy(node, "video"),
        errno.EPERM: f"give this container or sandbox access to {node}",
        errno.ENOENT: f"give this container or sandbox the device {node}",
        errno.EBUSY: "end the other program that uses it to see its formats",
        errno.ENODEV: "plug it in again",
    }
    return Unseen(
        str(node),
        f"camera {node} cannot be asked for its formats ({error.strerror})",
        remedies.get(error.errno or 0, "plug it in again, and see dmesg"),
    )


def _make_unnamed(node: Path, names: V4lNames) -> Unseen:
    return Unseen(
        str(node),
        f"camera {node} has no name that stays, and cannot be chosen",
        f"let udev make the links in {names.links}; into a container share that folder too",
    )
