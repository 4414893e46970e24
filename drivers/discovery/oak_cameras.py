"""OAK cameras on USB, by DepthAI's search without the network, and by the bus itself.

DepthAI answers without booting a camera. One that runs for somebody else is listed as in use.
"""

from dataclasses import dataclass
from pathlib import Path

from drivers.depthai_package import import_depthai
from drivers.discovery.listing import Listing, Unseen
from drivers.discovery.permissions import may_use
from navapp.errors import DeviceNotFound

# Of the chip in every OAK camera, before and after its boot.
_VENDOR = "03e7"
_USB_DEVICES = Path("/sys/bus/usb/devices")
_USB_NODES = Path("/dev/bus/usb")

UDEV_RULE = f'SUBSYSTEM=="usb", ATTRS{{idVendor}}=="{_VENDOR}", MODE="0666"'
UDEV_REMEDY = (
    f"echo '{UDEV_RULE}' | sudo tee /etc/udev/rules.d/80-movidius.rules && "
    "sudo udevadm control --reload-rules && sudo udevadm trigger, then plug the camera in again"
)


@dataclass(frozen=True, slots=True)
class OakCamera:
    """An OAK camera."""

    device_id: str  # what `[camera.depthai] device` takes
    port: str  # of the USB bus, as DepthAI tells it
    is_in_use: bool  # it is booted: a session has it, or it has not come to rest yet


def list_oak_cameras(
    usb_devices: Path = _USB_DEVICES, usb_nodes: Path = _USB_NODES
) -> Listing[OakCamera]:
    """Every camera that DepthAI finds, and what keeps it from finding others."""
    on_bus = list_oak_nodes(usb_devices, usb_nodes)
    forbidden = tuple(_forbidden(node) for node in on_bus if not may_use(node))
    try:
        dai = import_depthai()
    except DeviceNotFound as error:
        return Listing((), (*forbidden, Unseen.because(error)))
    try:
        infos = dai.Device.getAllAvailableDevices()
    except RuntimeError as error:
        return Listing((), (*forbidden, _make_unsearched(error)))
    booted = dai.XLinkDeviceState.X_LINK_BOOTED
    cameras = [OakCamera(i.getDeviceId(), i.name, i.state == booted) for i in infos]
    # A camera that may not be opened does not tell its id.
    return Listing(tuple(camera for camera in cameras if camera.device_id), forbidden)


def list_oak_nodes(
    usb_devices: Path = _USB_DEVICES, usb_nodes: Path = _USB_NODES
) -> tuple[Path, ...]:
    """Device files of the OAK cameras on the bus; whether they may be used is another question."""
    nodes = []
    for vendor in sorted(usb_devices.glob("*/idVendor")):
        try:
            if vendor.read_text(encoding="ascii").strip() != _VENDOR:
                continue
            bus, device = (
                int((vendor.parent / name).read_text(encoding="ascii"))
                for name in ("busnum", "devnum")
            )
        except (OSError, ValueError):
            continue  # unplugged while we looked
        nodes.append(usb_nodes / f"{bus:03d}" / f"{device:03d}")
    return tuple(nodes)


def _forbidden(node: Path) -> Unseen:
    if not node.exists():
        remedy = f"give this container or sandbox the folder {node.parents[1]}"
        return Unseen(str(node), f"an OAK camera is connected, but there is no {node}", remedy)
    problem = f"an OAK camera is connected at {node}, but this user may not use it"
    return Unseen(str(node), problem, UDEV_REMEDY)


def _make_unsearched(error: RuntimeError) -> Unseen:
    return Unseen(
        "usb",
        f"the USB bus cannot be searched for OAK cameras ({error})",
        "in a container or virtual machine, give it /dev/bus/usb; otherwise see lsusb",
    )
