"""The OAK driver above DepthAI's own pipeline, messages and calibration on the host."""

import re
import time
from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest

from drivers.clock import SystemClock
from drivers.depthai_settings import DepthaiSettings
from drivers.depthai_stereo import DepthaiStereo
from navapp.errors import (
    DeviceLost,
    DeviceNotFound,
    DeviceProtocolError,
    DeviceTimeout,
    UnsupportedControl,
    UsageError,
    WrongDevice,
)
from tests.drivers.host_oak import HEIGHT, RATE_HZ, WIDTH, HostOak
from tests.drivers.losing import fails_within

pytestmark = pytest.mark.waits

OAK_ID = "14442C10D13EABCE00"
SETTINGS = DepthaiSettings(width=WIDTH, height=HEIGHT, rate_hz=RATE_HZ)


@pytest.fixture
def oak():
    return HostOak()


@pytest.fixture
def camera(oak):
    camera = DepthaiStereo(SETTINGS, SystemClock(), rig_id="rig", open_device=oak.open_parts)
    yield camera
    camera.close()


def test_a_pair_is_of_one_instant_on_the_hosts_clock(oak, camera):
    oak.skew = timedelta(microseconds=300)
    camera.open()
    before_ns = time.monotonic_ns()
    frames = [camera.read(1.0) for _ in range(5)]
    for frame in frames:
        assert frame.left.shape == (HEIGHT, WIDTH)
        assert int(frame.right[0, 0]) - int(frame.left[0, 0]) == 50
        assert frame.skew_ns == 300_000
        # 1234 s lie between the clocks of host and camera.
        assert before_ns - 100e6 < frame.captured_ns < frame.received_ns
        assert frame.rig_id == "rig"
    gaps = np.diff([frame.captured_ns for frame in frames]) / 10e6
    assert np.abs(gaps - np.round(gaps)).max() < 1e-3
    info = camera.info
    assert info.measured_skew_ms == pytest.approx(0.3)
    assert info.measured_rate_hz == pytest.approx(4e2 / gaps.sum(), rel=1e-6)


def test_link_boot_and_identity_are_told(oak, camera):
    oak.usb_speed = "HIGH"
    camera.open()
    info = camera.info
    assert info.serials == (oak.device_id, oak.device_id)
    assert info.notes == (
        "USB HIGH, booted in 2.5 s",
        "the link is slow: use a USB 3 port and cable",
    )
    assert info.factory_rig is not None


def test_exposure_is_what_the_pictures_say(camera):
    camera.open()
    assert camera.set("exposure_ms", 4.0) == pytest.approx(3.99)
    assert camera.set("iso", 400.0) == 400.0
    camera.read(1.0)
    assert camera.info.controls["exposure_ms"] == pytest.approx(3.99)
    camera.close()
    camera.open()
    camera.read(1.0)
    assert camera.info.controls == {"exposure_ms": pytest.approx(3.99), "iso": 400.0}


def test_an_exposure_that_never_comes_is_told_as_it_is(oak, camera):
    camera.open()
    oak.is_deaf = True
    assert camera.set("exposure_ms", 2.0) == pytest.approx(5.01)


def test_infrared_lamps_are_refused_where_there_are_none(oak, camera):
    camera.open()
    assert camera.set("ir_dots", 0.5) == 0.5
    assert camera.info.controls["ir_dots"] == 0.5
    oak.lamps.clear()
    with pytest.raises(UnsupportedControl, match="has no lamp ir_flood"):
        camera.set("ir_flood", 0.5)
    camera.close()
    with pytest.raises(UnsupportedControl, match="has no lamp ir_dots"):
        camera.open()


def test_settings_that_no_camera_has_are_refused():
    with pytest.raises(UsageError, match="iso of an OAK camera cannot be 5000: use 100 to 1600"):
        DepthaiSettings(controls={"iso": 5000.0})
    with pytest.raises(UsageError, match="exposure_ms"):
        DepthaiSettings(rate_hz=30.0, controls={"exposure_ms": 40.0})
    for wrong in ({"rate_hz": 0.0}, {"width": 0}, {"rate_hz": float("inf")}):
        with pytest.raises(UsageError):
            DepthaiSettings(**wrong)


def test_another_camera_in_its_place_is_refused_and_released(oak, camera):
    camera.open()
    camera.close()
    oak.device_id = "STRANGER"
    with pytest.raises(WrongDevice, match="STRANGER stands where 14442C10D13EABCE00 stood"):
        camera.open()
    with pytest.raises(DeviceLost):
        camera.read(0.0)


def test_an_unplugged_camera_is_lost_and_comes_back(oak, camera):
    camera.open()
    before = camera.read(1.0)
    oak.unplug()
    assert "is gone" in str(fails_within(camera, DeviceLost))
    camera.close()
    with pytest.raises(DeviceNotFound):
        camera.open()
    oak.is_plugged = True
    camera.open()
    after = camera.read(1.0)
    assert after.sequence > before.sequence
    assert after.captured_ns > before.captured_ns


@pytest.mark.parametrize("control", ["exposure_ms", "ir_dots"])
def test_a_control_of_an_unplugged_camera_says_that_it_is_lost(oak, camera, control):
    camera.open()
    oak.unplug()
    with pytest.raises(DeviceLost, match=f"{OAK_ID} is gone"):
        camera.set(control, 0.5)


def test_a_camera_unplugged_while_it_is_opened_is_lost_and_released(oak):
    lit = replace(SETTINGS, controls={**SETTINGS.controls, "ir_dots": 0.5})
    camera = DepthaiStereo(lit, SystemClock(), open_device=oak.open_parts)
    set_infrared = oak.set_infrared

    def pulled(lamp, brightness):
        oak.is_plugged = False
        return set_infrared(lamp, brightness)

    oak.set_infrared = pulled
    with pytest.raises(DeviceLost, match=f"{OAK_ID} is gone"):
        camera.open()
    with pytest.raises(DeviceLost, match="is not open"):
        camera.read(0.0)


def test_a_camera_that_starts_anew_after_closing_is_waited_for(oak, camera):
    camera.open()
    camera.close()
    oak.n_absent = 2
    camera.open()
    assert oak.n_absent == 0
    oak.unplug()
    fails_within(camera, DeviceLost)
    camera.close()
    begin_s = time.monotonic()
    with pytest.raises(DeviceNotFound):  # one that was pulled is not
        camera.open()
    assert time.monotonic() - begin_s < 1.0


@pytest.mark.parametrize("device", ["", OAK_ID])
def test_whoever_opens_a_camera_that_starts_anew_waits_for_it(oak, camera, device):
    camera.open()
    camera.close()
    oak.n_absent = 2
    other = DepthaiStereo(
        replace(SETTINGS, device=device), SystemClock(), open_device=oak.open_parts
    )
    other.open()
    assert oak.n_absent == 0
    other.close()


def test_nobody_waits_for_another_camera(oak, camera):
    camera.open()
    camera.close()
    settings = replace(SETTINGS, device="ANOTHER")
    other = DepthaiStereo(settings, SystemClock(), open_device=oak.open_parts)
    begin_s = time.monotonic()
    with pytest.raises(DeviceNotFound):
        other.open()
    assert time.monotonic() - begin_s < 1.0


def test_a_stalled_camera_times_out_then_is_lost(oak, camera):
    camera.open()
    camera.read(1.0)
    oak.is_stalled = True
    time.sleep(0.05)
    fails_within(camera, DeviceTimeout)
    error = str(fails_within(camera, DeviceLost))
    silent_s = re.search(r"no new pair for (\d+) s", error)
    assert silent_s is not None, error
    assert int(silent_s[1]) >= 3  # longer on a busy machine


def test_old_and_skewed_pairs_are_dropped_and_counted(oak, camera):
    oak.age = timedelta(milliseconds=400)
    camera.open()
    with pytest.raises(DeviceTimeout):
        camera.read(0.2)
    assert camera.info.n_stale > 3
    oak.age = timedelta(milliseconds=4)
    oak.skew = timedelta(milliseconds=2)
    fails_within(camera, DeviceTimeout)
    time.sleep(0.1)
    fails_within(camera, DeviceTimeout)
    assert camera.info.n_unpaired > 3


def test_pictures_from_the_future_are_none(oak, camera):
    oak.age = timedelta(milliseconds=-500)
    camera.open()
    with pytest.raises(DeviceTimeout):
        camera.read(0.2)


def test_pictures_of_another_size_end_it(oak, camera):
    oak.shape = (HEIGHT, 2 * WIDTH)
    camera.open()
    assert "shape (48, 128) where (48, 64)" in str(fails_within(camera, DeviceProtocolError))
