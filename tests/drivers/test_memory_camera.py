"""A camera of frames in memory: the contract of cameras, the clock, the order and the end."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from drivers.clock import ManualClock
from drivers.contracts import CAMERA_CHECKS, CameraUnderTest
from drivers.frames import StereoFrame
from drivers.memory_camera import MemoryCamera
from navapp.errors import DeviceLost, EndOfSequence, UnsupportedControl
from tests.drivers.recordings import HEIGHT, WIDTH, frame, number_of

START_NS, PERIOD_NS = 10**9, 66_000_000
FRAMES = [frame(number, START_NS + number * PERIOD_NS) for number in range(4)]
LATE = [replace(one, received_ns=one.captured_ns + 5_000_000) for one in FRAMES]


@pytest.mark.parametrize("check", CAMERA_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize(
    ("frames", "is_simulated"), [(FRAMES, False), (FRAMES, True), (LATE, False)]
)
def test_it_keeps_the_contract(check, frames, is_simulated) -> None:
    def make() -> CameraUnderTest:
        clock = ManualClock()
        return CameraUnderTest(MemoryCamera(frames, clock, is_simulated=is_simulated), clock)

    check(make)


def test_frames_come_in_their_order_and_the_clock_moves_to_each() -> None:
    clock = ManualClock()
    camera = MemoryCamera(FRAMES, clock)
    camera.open()
    assert clock.now_ns() == 0
    for number, given in enumerate(FRAMES):
        one = camera.read(0.0)
        assert one is given
        assert number_of(one.left) == number
        assert clock.now_ns() == START_NS + number * PERIOD_NS
    for _ in range(2):
        with pytest.raises(EndOfSequence, match="memory ended"):
            camera.read(1.0)
    assert clock.now_ns() == FRAMES[-1].captured_ns


def test_the_clock_never_runs_backwards() -> None:
    clock = ManualClock(10**12)
    camera = MemoryCamera(FRAMES, clock)
    camera.open()
    camera.read(0.0)
    assert clock.now_ns() == 10**12


def test_reopening_begins_with_the_first_frame() -> None:
    camera = MemoryCamera(FRAMES, ManualClock())
    camera.open()
    for _ in FRAMES:
        camera.read(0.0)
    camera.close()
    with pytest.raises(DeviceLost, match="open it"):
        camera.read(0.0)
    camera.open()
    assert camera.read(0.0) is FRAMES[0]


class Asked(Sequence[StereoFrame]):
    """Notes which frames were asked for."""

    def __init__(self) -> None:
        self.places: list[int] = []

    def __len__(self) -> int:
        return len(FRAMES)

    def __getitem__(self, place):
        self.places.append(place)
        return FRAMES[place]


def test_frames_are_asked_for_when_they_are_read() -> None:
    asked = Asked()
    camera = MemoryCamera(asked, ManualClock())
    asked.places.clear()
    camera.open()
    assert camera.info.n_frames == 4
    camera.read(0.0)
    camera.read(0.0)
    assert asked.places == [0, 1]


def test_info_tells_size_length_and_that_it_is_stepped() -> None:
    info = MemoryCamera(FRAMES, ManualClock(), "room", is_simulated=True).info
    assert (info.name, info.is_simulated, info.is_stepped) == ("sim:room", True, True)
    assert (info.width, info.height, info.n_frames) == (WIDTH, HEIGHT, 4)
    assert MemoryCamera(FRAMES, ManualClock(), "room").info.name == "room"


def test_grey_pictures_have_a_size_too() -> None:
    picture = np.zeros((6, 9), np.uint8)
    grey = [replace(one, left=picture, right=picture) for one in FRAMES]
    info = MemoryCamera(grey, ManualClock()).info
    assert (info.width, info.height) == (9, 6)


def test_no_frames_and_no_controls() -> None:
    with pytest.raises(ValueError, match="at least one frame"):
        MemoryCamera([], ManualClock())
    with pytest.raises(UnsupportedControl, match="cannot change gain"):
        MemoryCamera(FRAMES, ManualClock()).set("gain", 1.0)
