"""Lists connected devices without disturbing programs that use them.

Nothing is started, streamed, booted or sent: devices are asked for their names and abilities only.
"""

from drivers.discovery.listing import Listing, Unseen
from drivers.discovery.oak_cameras import OakCamera, list_oak_cameras
from drivers.discovery.screens import list_screens
from drivers.discovery.serial_ports import FoundPort, list_serial_ports
from drivers.discovery.v4l_cameras import UsbCamera, list_usb_cameras
from drivers.discovery.v4l_formats import PictureSize, PixelFormat

__all__ = [
    "FoundPort",
    "Listing",
    "OakCamera",
    "PictureSize",
    "PixelFormat",
    "Unseen",
    "UsbCamera",
    "list_oak_cameras",
    "list_screens",
    "list_serial_ports",
    "list_usb_cameras",
]
