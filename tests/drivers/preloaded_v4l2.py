"""The driver above OpenCV's own V4L2 code, above cameras that a preloaded library plays.

Not collected by itself: `test_v4l2.py` compiles the library and runs this file with it.
"""

import mmap
import os
import struct
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from drivers.clock import SystemClock
from drivers.contracts import CAMERA_CHECKS, CameraUnderTest
from drivers.discovery import list_usb_cameras
from drivers.opencv_stereo import OpencvStereo, OpencvStereoSettings
from drivers.uvc_settings import UvcSettings
from navapp.errors import (
    DeviceError,
    DeviceLost,
    DeviceNotFound,
    DeviceTimeout,
    UnsupportedControl,
)
from tests.drivers.fake_capture import FakeBus
from tests.drivers.losing import fails_within

# As in v4l2_fake.c.
LINE = struct.Struct("iiiiid")
PLUGGED, STALLED, NO_BANDWIDTH, FORBIDDEN, N_OPEN, OFFSET = range(6)
ROOT = Path(os.environ["V4L2_FAKE_ROOT"])


class Bus(FakeBus):
    """Names and the library's page."""

    def __init__(self) -> None:
        super().__init__(ROOT)
        with (ROOT / "page").open("r+b") as file:
            self._page = mmap.mmap(file.fileno(), 0)
        self.put(1, "LEFT", offset_s=0.0)
        self.put(2, "RIGHT", offset_s=0.002)

    def put(self, port: int, serial: str, offset_s: float) -> None:
        self.plug(serial, port)
        self.write(port, PLUGGED, 1)
        self.write(port, STALLED, 0)
        self.write(port, NO_BANDWIDTH, 0)
        self.write(port, FORBIDDEN, 0)
        self.write(port, OFFSET, offset_s)

    def pull(self, port: int) -> None:
        self.write(port, PLUGGED, 0)
        self.unplug(next(c for n, c in self.cameras.items() if n.name == f"video{2 * port}"))

    def write(self, port: int, field: int, value: float) -> None:
        line = list(LINE.unpack_from(self._page, 2 * port * LINE.size))
        line[field] = value
        LINE.pack_into(self._page, 2 * port * LINE.size, *line)

    def n_open(self, port: int) -> int:
        return LINE.unpack_from(self._page, 2 * port * LINE.size)[N_OPEN]

    def stereo(self, **eye: object) -> OpencvStereo:
        settings = UvcSettings(**{"width": 640, "height": 480, **eye})
        pair = OpencvStereoSettings("LEFT", "RIGHT", settings)
        return OpencvStereo(pair, SystemClock(), names=self.names)


@pytest.fixture
def bus() -> Iterator[Bus]:
    picture = np.zeros((480, 640, 3), np.uint8)
    picture[:, 320:] = 200
    for size in ((640, 480), (1280, 720)):
        cv2.imwrite(str(ROOT / f"{size[0]}x{size[1]}.jpg"), cv2.resize(picture, size))
    bus = Bus()
    yield bus
    assert bus.n_open(1) == bus.n_open(2) == 0


@pytest.fixture
def camera(bus: Bus) -> Iterator[OpencvStereo]:
    camera = bus.stereo(controls={"exposure_ms": 5.0, "focus": 20.0, "white_balance_k": 5000.0})
    yield camera
    camera.close()


@pytest.mark.parametrize("fourcc", ["MJPG", "YUYV"])
@pytest.mark.parametrize("check", CAMERA_CHECKS, ids=lambda check: check.__name__)
def test_the_contract_is_kept(bus, check, fourcc):
    def make() -> CameraUnderTest:
        camera = bus.stereo(fourcc=fourcc)
        return CameraUnderTest(camera, SystemClock(), ("exposure_ms", 5.0))

    check(make)


def test_pairs_carry_the_drivers_times_and_what_was_read_back(camera):
    camera.open()
    frames = [camera.read(2.0) for _ in range(8)]
    info = camera.info
    assert [note.partition(": ")[2] for note in info.notes] == [
        "capture time is the driver's clock"
    ] * 2
    for frame in frames:
        assert frame.skew_ns == pytest.approx(2e6, abs=2e3)
        # Mid exposure of multiples of the period, to the stamp's microsecond.
        periods = (frame.captured_ns * 1e-9 - 0.0025) * 30.0
        assert periods == pytest.approx(round(periods), abs=1e-3)
        assert frame.received_ns - frame.captured_ns < 250e6
    assert info.controls == {
        "exposure_ms": 5.0,
        "focus": 20.0,
        "gain": 0.0,
        "white_balance_k": 5000.0,
    }
    assert frames[0].left.mean() == pytest.approx(100.0, abs=2.0)  # decoded from MJPG


def test_what_the_camera_does_not_offer_is_refused_though_set_returns_true(bus):
    with pytest.raises(DeviceError, match="LEFT has MJPG 640x480 at 30 Hz where MJPG 800x600"):
        bus.stereo(width=800, height=600).open()
    with pytest.raises(DeviceError, match="LEFT has YUYV 640x480 at 30 Hz where H264"):
        bus.stereo(fourcc="H264").open()
    with pytest.raises(DeviceError, match="at 30 Hz where MJPG 640x480 at 60 Hz"):
        bus.stereo(rate_hz=60.0).open()
    with pytest.raises(UnsupportedControl, match="white_balance_k 9000 and has 6500"):
        bus.stereo(controls={"white_balance_k": 9000.0}).open()


def test_a_pause_of_the_reader_gives_no_old_picture(bus, camera):
    """OpenCV's next picture would be that of the beginning of the pause."""
    camera.open()
    camera.read(2.0)
    time.sleep(0.5)
    frame = camera.read(2.0)
    assert time.monotonic_ns() - frame.captured_ns < 200e6


def test_an_unplugged_camera_is_lost_at_once_and_comes_back_with_its_settings(bus, camera):
    camera.open()
    camera.read(2.0)
    bus.pull(2)
    begin_s = time.monotonic()
    lost(camera, "RIGHT gives no more pictures")
    assert time.monotonic() - begin_s < 1.0
    camera.close()
    with pytest.raises(DeviceNotFound, match="RIGHT is not connected"):
        camera.open()
    bus.put(3, "RIGHT", offset_s=0.001)
    camera.open()
    assert camera.read(2.0).skew_ns == pytest.approx(1e6, abs=2e3)
    assert camera.info.controls["exposure_ms"] == 5.0
    camera.close()
    bus.pull(3)


def test_a_stalled_camera_times_out_and_is_lost_within_five_seconds(bus, camera):
    camera.open()
    camera.read(2.0)
    bus.write(1, STALLED, 1)
    time.sleep(0.3)  # until the last pair is too old to be handed out
    with pytest.raises(DeviceTimeout):
        camera.read(0.2)
    begin_s = time.monotonic()
    lost(camera, "LEFT g")
    assert time.monotonic() - begin_s < 5.0


def test_two_cameras_on_a_line_too_narrow_are_told_so(bus, camera):
    bus.write(2, NO_BANDWIDTH, 1)
    camera.open()
    lost(camera, "RIGHT was opened but gives no picture: give each camera a USB controller")


def test_a_camera_that_another_one_holds_is_not_opened(bus, camera):
    camera.open()
    with pytest.raises(DeviceNotFound, match="end the other program that uses it"):
        bus.stereo().open()


def test_both_eyes_side_by_side(bus):
    settings = OpencvStereoSettings("LEFT", None, UvcSettings(width=640, height=720))
    camera = OpencvStereo(settings, SystemClock(), names=bus.names)
    camera.open()
    frame = camera.read(2.0)
    camera.close()
    assert frame.left.shape == (720, 640, 3)
    assert frame.left[:, :600].max() < 20
    assert frame.right[:, 40:].min() > 180


def test_unplugs_leave_no_descriptor(bus, camera):
    for _ in range(3):
        cycle(bus, camera)
    n_before = len(os.listdir("/proc/self/fd"))
    for _ in range(10):  # each would leave one
        cycle(bus, camera)
    assert len(os.listdir("/proc/self/fd")) == n_before


def cycle(bus: Bus, camera: OpencvStereo) -> None:
    camera.open()
    bus.pull(2)
    lost(camera, "RIGHT")
    camera.close()
    bus.put(2, "RIGHT", offset_s=0.002)


def lost(camera: OpencvStereo, sentence: str) -> None:
    assert sentence in str(fails_within(camera, DeviceLost))


def test_a_running_session_is_not_disturbed_by_a_look_at_its_cameras(bus, camera):
    """A session holds its cameras open; this stand-in lets nobody else open them, unlike most."""
    camera.open()
    first = camera.read(2.0)
    listing = list_usb_cameras(bus.names)
    assert [one.serial for one in listing.found] == ["LEFT", "RIGHT"]
    assert camera.read(2.0).sequence > first.sequence
