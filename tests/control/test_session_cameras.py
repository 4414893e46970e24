"""A session with the real camera drivers on fakes: every fault is told, and dark in time."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace

import pytest

from drivers.clock import SystemClock
from drivers.depthai_settings import DepthaiSettings
from drivers.depthai_stereo import DepthaiStereo
from drivers.interfaces import StereoCamera
from navapp.control.states import DeviceHealth, EventLevel
from navapp.values import Reason
from tests.control.fakes import HEIGHT, WIDTH, Bench, navigating
from tests.drivers.usb_rigs import UsbRig

pytestmark = pytest.mark.waits

# A picture may stay for half a second (`overlay_valid_ms`); the rest is for a busy machine.
DARK_S = 0.5 + 2.5
# Three seconds of silence make a camera lost.
LOST_S = 3.0 + 4.0
BACK_S = 20.0


class Room:
    """A session in front of a camera, and what came of a fault of it."""

    def __init__(self, camera: StereoCamera) -> None:
        self.bench = Bench(camera=camera, clock=SystemClock())

    def begin(self) -> None:
        self.bench.until(lambda: self.bench.state == "ready", 5.0)
        navigating(self.bench)
        self.bench.until(lambda: self.bench.shows_guides, 5.0)

    def is_dark_in_time_after(self, deed: Callable[[], object]) -> None:
        deed()
        begin_s = time.monotonic()
        self.bench.until(lambda: self.bench.is_dark, 10.0)
        assert time.monotonic() - begin_s < DARK_S

    def is_lost_with(self, words: str) -> None:
        bench = self.bench
        bench.until(lambda: bench.state == "fault", LOST_S)
        assert bench.line("camera").health is DeviceHealth.LOST
        assert bench.snapshot.reasons[0] is Reason.DEVICE_FAULT
        alarms = [event.text for event in bench.events if event.level is EventLevel.ALARM]
        assert words in alarms[-1]
        assert bench.is_dark

    def stays_dark_because(self, words: str) -> None:
        bench = self.bench
        bench.until(lambda: words in bench.line("camera").detail, BACK_S)
        assert bench.state == "fault"
        assert bench.is_dark

    def comes_back(self) -> None:
        bench = self.bench
        bench.until(lambda: bench.shows_guides, BACK_S)
        assert bench.state == "navigating"
        assert bench.line("camera").health is DeviceHealth.OK


class UsbRoom(Room):
    """Two USB cameras above fake capture objects."""

    def __init__(self, tmp_path) -> None:
        self.usb = UsbRig(tmp_path, rate_hz=30.0, exposure_ms=5.0)
        eye = replace(self.usb.settings.eye, width=WIDTH, height=HEIGHT)
        super().__init__(self.usb.stereo(replace(self.usb.settings, eye=eye)))

    def stall(self) -> None:
        """Grabs fail late, but three of them before three seconds of silence are over."""
        self.usb.left.stall_s, self.usb.left.is_stalled = 0.5, True

    def widen(self) -> None:
        self.usb.right.shape = (HEIGHT, 2 * WIDTH)

    def fall_out_of_step(self) -> None:
        self.usb.right.offset_s = 0.0166


@pytest.fixture
def usb(tmp_path) -> Iterator[UsbRoom]:
    with ExitStack() as stack:
        room = UsbRoom(tmp_path)
        stack.callback(room.bench.controller.close)
        room.begin()
        yield room


def setting(name: str, value: object) -> Callable[[UsbRoom], None]:
    return lambda room: setattr(room.usb.right, name, value)


USB_FAULTS: dict[str, tuple[Callable[[UsbRoom], None], str]] = {
    "stalled": (UsbRoom.stall, "camera L1 gives no more pictures"),
    "the same picture": (setting("is_frozen", True), "R1 has given no new picture for"),
    "damaged pictures": (setting("is_damaged", True), "R1 has given no new picture for"),
    "old pictures": (setting("late_s", 0.3), "R1 has given no new picture for"),
    "another size": (UsbRoom.widen, "R1 sent a picture of 640x240 where it had said 320x240"),
}


@pytest.mark.parametrize(("deed", "words"), USB_FAULTS.values(), ids=USB_FAULTS)
def test_a_usb_cameras_fault_is_told_and_dark_in_time(usb, deed, words) -> None:
    usb.is_dark_in_time_after(lambda: deed(usb))
    usb.is_lost_with(words)


def test_a_usb_grab_that_never_returns_is_told_and_dark_in_time(usb) -> None:
    capture = usb.usb.right.captures[-1]
    try:
        usb.is_dark_in_time_after(lambda: setattr(usb.usb.right, "is_hanging", True))
        usb.is_lost_with("R1 has given no new picture for")
    finally:
        usb.usb.right.is_hanging = False
        capture.released.set()


def test_an_unplugged_usb_camera_is_told_and_dark_and_comes_back(usb) -> None:
    usb.is_dark_in_time_after(lambda: usb.usb.bus.unplug(usb.usb.right))
    usb.is_lost_with("camera R1 gives no more pictures")
    usb.usb.bus.plug("STRANGER", 2)
    usb.stays_dark_because("camera R1 is not connected")
    usb.usb.bus.plug("R1", 5)
    usb.comes_back()


def test_usb_cameras_out_of_step_are_silent_and_dark_and_come_back(usb) -> None:
    bench = usb.bench
    usb.is_dark_in_time_after(usb.fall_out_of_step)
    bench.until(lambda: Reason.CAMERA_SILENT in bench.snapshot.reasons, LOST_S)
    assert bench.state == "navigating"
    assert bench.is_dark
    assert bench.line("camera").health is DeviceHealth.TROUBLE
    assert "ms apart: synchronise the cameras" in bench.line("camera").detail
    usb.usb.right.offset_s = 0.0
    usb.comes_back()


class OakRoom(Room):
    """An OAK camera above DepthAI's own pipeline on the host."""

    def __init__(self, monkeypatch) -> None:
        host_oak = pytest.importorskip("tests.drivers.host_oak", reason="needs the package depthai")
        self.oak = host_oak.HostOak()
        self.oak.shape = (HEIGHT, WIDTH)
        settings = DepthaiSettings("", WIDTH, HEIGHT, rate_hz=30.0)
        camera = DepthaiStereo(settings, SystemClock(), open_device=self.oak.open_parts)
        super().__init__(camera)


@pytest.fixture
def oak(monkeypatch) -> Iterator[OakRoom]:
    with ExitStack() as stack:
        room = OakRoom(monkeypatch)
        stack.callback(room.bench.controller.close)
        room.begin()
        yield room


OAK_FAULTS: dict[str, tuple[Callable[[OakRoom], None], str]] = {
    "stalled": (lambda room: setattr(room.oak, "is_stalled", True), "has given no new pair for"),
    "another size": (
        lambda room: setattr(room.oak, "shape", (HEIGHT, 2 * WIDTH)),
        "sent a picture of shape (240, 640) where (240, 320)",
    ),
}


@pytest.mark.parametrize(("deed", "words"), OAK_FAULTS.values(), ids=OAK_FAULTS)
def test_an_oak_cameras_fault_is_told_and_dark_in_time(oak, deed, words) -> None:
    oak.is_dark_in_time_after(lambda: deed(oak))
    oak.is_lost_with(words)


def test_an_unplugged_oak_camera_is_told_and_dark_and_comes_back(oak) -> None:
    oak.is_dark_in_time_after(oak.oak.unplug)
    oak.is_lost_with("is gone")
    first = oak.oak.device_id
    oak.oak.device_id, oak.oak.is_plugged = "STRANGER", True
    oak.stays_dark_because(f"STRANGER stands where {first} stood at first")
    oak.oak.device_id = first
    oak.comes_back()
