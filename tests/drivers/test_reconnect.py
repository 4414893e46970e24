"""Hundreds of times unplugged and plugged in again: nothing is left."""

import pytest

from drivers.clock import SystemClock
from drivers.depthai_settings import DepthaiSettings
from drivers.depthai_stereo import DepthaiStereo
from navapp.control.camera_link import CameraLink
from navapp.errors import DeviceLost, DeviceNotFound
from tests.drivers.firmware_rigs import ProjectorRig, StageRig
from tests.drivers.footprints import (
    CYCLES,
    assert_nothing_is_left,
    footprint,
    needs_descriptors,
)
from tests.drivers.losing import fails_within
from tests.drivers.usb_rigs import UsbRig

pytestmark = needs_descriptors


@pytest.mark.release
@pytest.mark.slow
@pytest.mark.parametrize("n_cycles", CYCLES)
def test_many_unplugged_usb_cameras_leave_nothing(tmp_path, n_cycles):
    rig = UsbRig(tmp_path, rate_hz=1000.0, max_skew_ms=0.4, exposure_ms=0.5)
    settled = (0, 0, 0, 0.0)
    for cycle in range(n_cycles):
        rig.camera.open()
        if cycle % 10 == 0:
            rig.camera.read(1.0)
        rig.bus.unplug(rig.left if cycle % 2 else rig.right)
        fails_within(rig.camera, DeviceLost, timeout_s=0.01)
        rig.camera.close()
        with pytest.raises(DeviceNotFound):
            rig.camera.open()
        if cycle % 2:
            rig.left = rig.bus.plug("L1", 1)
        else:
            rig.right = rig.bus.plug("R1", 2)
        if cycle == n_cycles // 2:  # the allocator has its pools by then
            settled = footprint()
    assert_nothing_is_left(settled, n_cycles)


@pytest.mark.slow
@pytest.mark.parametrize("n_cycles", CYCLES)
def test_many_unplugged_oak_cameras_leave_nothing(n_cycles):
    host_oak = pytest.importorskip("tests.drivers.host_oak", reason="needs the package depthai")
    oak = host_oak.HostOak()
    settings = DepthaiSettings("", host_oak.WIDTH, host_oak.HEIGHT, rate_hz=host_oak.RATE_HZ)
    camera = DepthaiStereo(settings, SystemClock(), open_device=oak.open_parts)
    settled = (0, 0, 0, 0.0)
    for cycle in range(n_cycles):
        oak.is_plugged = True
        camera.open()
        camera.read(1.0)
        oak.unplug()
        fails_within(camera, DeviceLost, timeout_s=0.01)
        camera.close()
        with pytest.raises(DeviceNotFound):
            camera.open()
        if cycle == n_cycles // 2:
            settled = footprint()
    assert_nothing_is_left(settled, n_cycles)


@pytest.mark.parametrize("n_cycles", CYCLES)
@pytest.mark.parametrize("make", [ProjectorRig, StageRig])
def test_many_pulled_plugs_of_projector_and_mirror_leave_nothing(make, n_cycles):
    rig = make()
    settled = (0, 0, 0, 0.0)
    for cycle in range(n_cycles):
        rig.driver.open()
        rig.wire.is_connected = False
        with pytest.raises(DeviceLost):
            rig.driver.status() if make is ProjectorRig else rig.driver.position_deg()
        with pytest.raises(DeviceNotFound):
            rig.driver.open()
        rig.wire.is_connected = True
        if cycle == n_cycles // 2:
            settled = footprint()
    assert_nothing_is_left(settled, n_cycles)


def test_a_session_goes_on_with_the_camera_that_was_unplugged(tmp_path):
    rig = UsbRig(tmp_path, exposure_ms=5.0)
    rig.camera.open()

    def reopen():
        rig.camera.open()
        return rig.camera

    link = CameraLink(rig.camera, rig.clock, reopen)
    before = link.take(2.0)
    rig.bus.unplug(rig.left)
    error = None
    while error is None:
        try:
            link.take(1.0)
        except DeviceLost as lost:
            error = str(lost)
    assert "L1 gives no more pictures" in error
    link.retry_now()
    assert not link.wait_for_return(0.0)
    assert "L1 is not connected" in link.trouble
    rig.bus.plug("L1", 4)
    assert not link.wait_for_return(0.0)  # not before the pause has passed
    link.retry_now()
    assert link.wait_for_return(0.0)
    after = link.take(2.0)
    link.close()
    assert after.sequence > before.sequence
    assert rig.left.n_open == rig.right.n_open == 0
