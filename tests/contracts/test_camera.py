"""Every camera backend keeps the contract, and the contract notices cameras that do not."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import ManualClock, SystemClock
from drivers.contracts import CAMERA_CHECKS, CameraUnderTest, ContractViolation
from drivers.depthai_settings import DepthaiSettings
from drivers.depthai_stereo import DepthaiStereo
from drivers.replay_camera import ReplayCamera, ReplaySettings
from drivers.session_files import SessionWriter
from navapp.errors import DeviceTimeout
from sim_devices.camera import SimulatedCamera
from sim_devices.scenario import Scenario
from sim_devices.world import World
from tests.drivers.recordings import frame, write_pairs, write_video
from tests.drivers.usb_rigs import UsbRig
from tests.sim_devices.plain_world import PlainWorld

pytestmark = pytest.mark.waits

Make = Callable[[], CameraUnderTest]


def stepped(_: Path) -> Make:
    def make() -> CameraUnderTest:
        clock = ManualClock(10**9)
        camera = SimulatedCamera(PlainWorld(), clock, is_stepped=True)
        return CameraUnderTest(camera, clock, ("exposure_ms", 12.0))

    return make


def free_running(_: Path) -> Make:
    def make() -> CameraUnderTest:
        clock = SystemClock()
        camera = SimulatedCamera(PlainWorld(), clock, is_stepped=False, rate_hz=50.0)
        return CameraUnderTest(camera, clock, ("gain_db", 6.0))

    return make


@cache
def operating_site() -> World:
    """Seen once: its kernels are compiled outside of the time that a read may take."""
    world = World(Scenario())
    camera = SimulatedCamera(world, ManualClock(10**9), is_stepped=True, scale=0.2)
    camera.open()
    camera.read(1.0)
    camera.close()
    return world


def rendered(_: Path) -> Make:
    def make() -> CameraUnderTest:
        clock = ManualClock(10**9)
        camera = SimulatedCamera(operating_site(), clock, is_stepped=True, scale=0.2)
        return CameraUnderTest(camera, clock, ("exposure_ms", 12.0))

    return make


def replayed(source: str | Path, settings: ReplaySettings | None = None) -> Make:
    def make() -> CameraUnderTest:
        clock = ManualClock()
        return CameraUnderTest(ReplayCamera(source, clock, settings or ReplaySettings()), clock)

    return make


def folder(path: Path) -> Make:
    return replayed(write_pairs(path / "pairs", range(4)))


def session(path: Path) -> Make:
    with SessionWriter(path) as writer:
        for number in range(4):
            writer.add(frame(number, 10**9 + number * 66_000_000, 1_000), with_pictures=True)
    return replayed(path)


def two_videos(path: Path) -> Make:
    left = write_video(path / "l.avi", ("left",), 4)
    return replayed(f"{left},{write_video(path / 'r.avi', ('right',), 4)}")


def one_video(path: Path) -> Make:
    video = write_video(path / "both.avi", ("left", "right"), 4)
    return replayed(video, ReplaySettings(is_side_by_side=True))


def two_usb_cameras(path: Path) -> Make:
    def make() -> CameraUnderTest:
        rig = UsbRig(path)
        return CameraUnderTest(rig.camera, rig.clock, ("exposure_ms", 5.0))

    return make


def usb_camera_without_stamps(path: Path) -> Make:
    def make() -> CameraUnderTest:
        rig = UsbRig(path, is_side_by_side=True)
        rig.left.stamps = "none"
        return CameraUnderTest(rig.camera, rig.clock, ("gain", 3.0))

    return make


def oak(_: Path) -> Make:
    host_oak = pytest.importorskip("tests.drivers.host_oak", reason="needs the package depthai")

    def make() -> CameraUnderTest:
        clock = SystemClock()
        size = host_oak.WIDTH, host_oak.HEIGHT
        settings = DepthaiSettings("", *size, rate_hz=host_oak.RATE_HZ)
        camera = DepthaiStereo(settings, clock, open_device=host_oak.HostOak().open_parts)
        return CameraUnderTest(camera, clock, ("exposure_ms", 5.0))

    return make


USB = (two_usb_cameras, usb_camera_without_stamps)
BACKENDS = (*USB, oak, stepped, free_running, rendered, folder, session, two_videos, one_video)


@pytest.mark.parametrize("check", CAMERA_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("backend", BACKENDS, ids=lambda backend: backend.__name__)
def test_camera_keeps_its_contract(backend, check, tmp_path):
    check(backend(tmp_path))


class Broken(SimulatedCamera):
    """Keeps the contract until a fault is built in."""

    def __init__(self) -> None:
        self.manual = ManualClock(10**9)
        super().__init__(PlainWorld(), self.manual, is_stepped=True)


class StandsStill(Broken):
    def read(self, timeout_s):
        return replace(super().read(timeout_s), captured_ns=0)


class CountsNothing(Broken):
    def read(self, timeout_s):
        return replace(super().read(timeout_s), sequence=0)


class SeesTheFuture(Broken):
    def read(self, timeout_s):
        one = super().read(timeout_s)
        return replace(one, captured_ns=one.received_ns + 1)


class ReusesItsBuffer(Broken):
    def __init__(self) -> None:
        super().__init__()
        self.buffer = np.zeros((48, 64, 3), np.uint8)

    def read(self, timeout_s):
        one = super().read(timeout_s)
        self.buffer[:] = one.left
        return replace(one, left=self.buffer)


class HasAnotherSize(Broken):
    @property
    def info(self):
        return replace(super().info, width=65)


class HidesThatItIsSimulated(Broken):
    @property
    def info(self):
        return replace(super().info, is_simulated=False)


class StartsAgain(Broken):
    def open(self):
        super().open()
        self._sequence = 0


class NeverOpensAgain(Broken):
    n_closed = 0

    def close(self):
        self.n_closed += 1
        super().close()

    def open(self):
        if self.n_closed:
            raise DeviceTimeout("busy")
        super().open()


class ClosesOnce(Broken):
    def close(self):
        self._opening += 1


class ReadsWhenClosed(Broken):
    def read(self, timeout_s):
        self.open()
        return super().read(timeout_s)


class AcceptsAnything(Broken):
    def set(self, control, value):
        return value


class ReadsBackSomethingElse(Broken):
    def set(self, control, value):
        return super().set(control, value) + 1.0


class KeepsAFileOpen(Broken):
    def open(self):
        super().open()
        self.file = Path(__file__).open()  # noqa: SIM115 (the leak is the point)


@pytest.mark.parametrize("camera", Broken.__subclasses__(), ids=lambda camera: camera.__name__)
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_broken_cameras_are_caught(camera):
    kept: list[Broken] = []

    def make() -> CameraUnderTest:
        kept.append(camera())
        return CameraUnderTest(kept[-1], kept[-1].manual, ("exposure_ms", 12.0))

    caught = []
    for check in CAMERA_CHECKS:
        try:
            check(make)
        except ContractViolation:
            caught.append(check.__name__)
        finally:
            for one in kept:
                if isinstance(one, KeepsAFileOpen) and hasattr(one, "file"):
                    one.file.close()
    assert caught


def test_camera_whose_read_blocks_is_caught():
    class Blocks(SimulatedCamera):
        def read(self, timeout_s):
            return super().read(timeout_s + 2.5)

    def make() -> CameraUnderTest:
        clock = SystemClock()
        camera = Blocks(PlainWorld(), clock, is_stepped=False, rate_hz=0.4)
        return CameraUnderTest(camera, clock, timeout_s=0.1)

    by_name = {check.__name__: check for check in CAMERA_CHECKS}
    with pytest.raises(ContractViolation, match="took 2"):
        by_name["check_short_timeouts"](make)
