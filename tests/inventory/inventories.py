"""What a look at a computer might give."""

from dataclasses import replace
from pathlib import Path

from drivers.discovery import (
    FoundPort,
    Listing,
    OakCamera,
    PictureSize,
    PixelFormat,
    Unseen,
    UsbCamera,
)
from drivers.window_outputs import Output
from navapp.inventory.camera_packages import InstalledCamera
from navapp.inventory.connected_devices import Inventory

WHY = Unseen("thing", "it cannot be looked at", "let me look")
USB = UsbCamera(
    Path("/dev/video0"),
    Path("/dev/v4l/by-id/usb-A1-video-index0"),
    "A1",
    "A1",
    "HD Cam",
    (PixelFormat("MJPG", "Motion-JPEG", (PictureSize(1280, 720, (30.0,)),)),),
)
OAK = OakCamera("14442C10D13EABCE00", "1.2", is_in_use=True)
ACME = InstalledCamera("acme", "acme:make", "acme 1.0")
PORT = FoundPort("/dev/ttyUSB0", "/dev/serial/by-id/usb-FT", "FT232R", "FTDI", "A50285BI")
DESK = Output(0, 'DELL 24"', 0, 0, 1920, 1200)
BEAMER = Output(1, "EPSON PJ", 1920, 0, 1280, 720)

NOTHING = Inventory(Listing(), Listing(), Listing(), Listing(), Listing((), (WHY,)))
EVERYTHING = Inventory(
    Listing((USB, replace(USB, chosen_by="", path=None, serial=""))),
    Listing((OAK,)),
    Listing((ACME,), (WHY,)),
    Listing((PORT,)),
    Listing((DESK, BEAMER)),
)
