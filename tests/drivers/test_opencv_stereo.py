"""The driver of USB cameras above fake capture objects: settings, pairs, faults."""

import re
import threading
import time
from dataclasses import replace

import cv2
import numpy as np
import pytest

from drivers.opencv_stereo import OpencvStereoSettings
from drivers.uvc_settings import UvcSettings
from navapp.errors import (
    DeviceError,
    DeviceLost,
    DeviceNotFound,
    DeviceProtocolError,
    DeviceTimeout,
    UnsupportedControl,
    UsageError,
    WrongDevice,
)
from tests.drivers import recordings
from tests.drivers.fake_capture import MJPG
from tests.drivers.losing import fails_within
from tests.drivers.recordings import number_of, write_video
from tests.drivers.usb_rigs import HEIGHT, RATE_HZ, WIDTH, UsbRig

pytestmark = pytest.mark.waits


@pytest.fixture
def rig(tmp_path):
    rig = UsbRig(tmp_path, exposure_ms=5.0, white_balance_k=5000.0)
    yield rig
    rig.camera.close()


# Settings


def test_everything_is_asked_for_and_what_the_camera_has_is_told(rig):
    rig.camera.open()
    for fake in (rig.left, rig.right):
        props = fake.captures[-1].props
        assert props[cv2.CAP_PROP_FOURCC] == MJPG
        assert props[cv2.CAP_PROP_BUFFERSIZE] == 1.0
        assert props[cv2.CAP_PROP_FPS] == RATE_HZ
        assert props[cv2.CAP_PROP_AUTO_EXPOSURE] == 1.0
        assert props[cv2.CAP_PROP_AUTO_WB] == 0.0
        assert props[cv2.CAP_PROP_AUTOFOCUS] == 0.0
        assert props[cv2.CAP_PROP_EXPOSURE] == 50.0
        asked = fake.captures[-1].asked
        order = [cv2.CAP_PROP_FOURCC, cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT]
        assert asked[1:6] == [*order, cv2.CAP_PROP_FPS, cv2.CAP_PROP_BUFFERSIZE]
    info = rig.camera.info
    assert info.controls == {
        "exposure_ms": 5.0,
        "white_balance_k": 5000.0,
        "gain": 0.0,
        "focus": 30.0,
    }
    assert info.serials == ("L1", "R1")
    assert (info.width, info.height) == (WIDTH, HEIGHT)


@pytest.mark.parametrize(
    ("stubborn", "sentence"),
    [
        (cv2.CAP_PROP_FOURCC, "R1 has YUYV 64x48 at 100 Hz where MJPG 64x48"),
        (cv2.CAP_PROP_FRAME_WIDTH, "R1 has MJPG 640x48 at"),
        (cv2.CAP_PROP_FPS, "at 30 Hz where MJPG 64x48 at 100 Hz was asked for"),
        (cv2.CAP_PROP_MODE, "R1 does not tell its controls in true units"),
        (cv2.CAP_PROP_AUTO_EXPOSURE, "R1 keeps its automatic for exposure_ms"),
        (cv2.CAP_PROP_AUTO_WB, "R1 keeps its automatic for white_balance_k"),
        (cv2.CAP_PROP_AUTOFOCUS, "R1 keeps its automatic for focus"),
        (cv2.CAP_PROP_EXPOSURE, "R1 was asked for exposure_ms 5 and has 15.6"),
    ],
)
def test_a_camera_that_says_yes_and_does_otherwise_is_refused(rig, stubborn, sentence):
    rig.right.stubborn.add(stubborn)
    rig.right.is_normalised = True
    with pytest.raises(DeviceError, match=sentence):
        rig.camera.open()
    assert rig.left.n_open == rig.right.n_open == 0


def test_a_camera_without_a_control_is_refused_only_when_that_is_asked_for(tmp_path):
    rig = UsbRig(tmp_path, exposure_ms=5.0)
    rig.left.absent = rig.right.absent = {
        cv2.CAP_PROP_FOCUS, cv2.CAP_PROP_AUTOFOCUS, cv2.CAP_PROP_AUTO_WB,
    }  # fmt: skip
    rig.camera.open()
    assert "focus" not in rig.camera.info.controls
    rig.camera.close()
    asked = replace(rig.settings, eye=replace(rig.settings.eye, controls={"focus": 30.0}))
    with pytest.raises(UnsupportedControl, match="L1 has no control focus"):
        rig.stereo(asked).open()


def test_a_driver_that_keeps_more_pictures_is_told(rig):
    rig.left.stubborn.add(cv2.CAP_PROP_BUFFERSIZE)
    rig.camera.open()
    assert rig.camera.info.notes[0].endswith("the driver keeps 4 pictures")
    assert "keeps" not in rig.camera.info.notes[1]


def test_the_step_that_the_camera_takes_is_what_is_told(rig):
    rig.camera.open()
    rig.left.steps = rig.right.steps = {cv2.CAP_PROP_EXPOSURE: 20.0}
    assert rig.camera.set("exposure_ms", 5.9) == 6.0
    assert rig.camera.info.controls["exposure_ms"] == 6.0


def test_eyes_that_take_different_values_are_refused(rig):
    rig.camera.open()
    rig.right.steps = {cv2.CAP_PROP_GAIN: 8.5}
    with pytest.raises(UnsupportedControl, match=r"different values for gain: 8 and 8\.5"):
        rig.camera.set("gain", 8.0)
    assert rig.camera.info.controls["gain"] == 0.0


def test_a_value_that_one_eye_does_not_take_leaves_both_as_they_were(rig):
    rig.camera.open()
    rig.right.stubborn.add(cv2.CAP_PROP_EXPOSURE)
    with pytest.raises(UnsupportedControl, match="R1 was asked for exposure_ms 8 and has 5"):
        rig.camera.set("exposure_ms", 8.0)
    assert rig.camera.info.controls["exposure_ms"] == 5.0
    rig.camera.close()
    rig.right.stubborn.clear()
    rig.camera.open()
    assert rig.camera.info.controls["exposure_ms"] == 5.0


def test_a_reopening_asks_for_what_was_wished_and_not_for_what_it_became(rig):
    rig.camera.open()
    rig.left.steps = rig.right.steps = {cv2.CAP_PROP_EXPOSURE: 20.0}
    assert rig.camera.set("exposure_ms", 5.9) == 6.0
    rig.camera.close()
    rig.left.steps = rig.right.steps = {}
    rig.camera.open()
    assert rig.camera.info.controls["exposure_ms"] == 5.9


def test_a_control_that_was_set_survives_a_reopening(rig):
    rig.camera.open()
    rig.camera.set("gain", 7.0)
    rig.camera.close()
    rig.camera.open()
    assert rig.camera.info.controls["gain"] == 7.0
    assert rig.camera.info.controls["exposure_ms"] == 5.0


def test_each_capture_is_used_by_one_thread_after_it_was_opened(rig):
    rig.camera.open()
    rig.camera.read(1.0)
    for fake in (rig.left, rig.right):
        assert len(fake.captures[-1].threads) == 1
        assert threading.get_ident() not in fake.captures[-1].threads


def test_settings_that_mean_nothing_are_refused():
    with pytest.raises(UsageError, match="not below half of the frame period: use less than 5"):
        OpencvStereoSettings("L1", "R1", UvcSettings(rate_hz=100.0), max_skew_ms=5.0)
    with pytest.raises(UsageError, match="no camera is named"):
        OpencvStereoSettings("", "R1", UvcSettings())
    for wrong in ({"fourcc": "MJPEG"}, {"rate_hz": 0.0}, {"width": 0}, {"max_age_ms": 0.0}):
        with pytest.raises(UsageError):
            UvcSettings(**wrong)


# Identity


def test_the_same_camera_for_both_eyes_is_refused(rig):
    with pytest.raises(WrongDevice, match="left and right are the same camera L1"):
        rig.stereo(replace(rig.settings, right="L1")).open()


def test_another_camera_at_the_same_port_is_refused(rig):
    port = str(rig.bus.names.links / "by-path" / "pci-0-usb-0:2-video-index0")
    camera = rig.stereo(replace(rig.settings, right=port))
    camera.open()
    camera.close()
    rig.bus.unplug(rig.right)
    rig.bus.plug("STRANGER", 2)
    with pytest.raises(WrongDevice, match="L1 and STRANGER stand where L1 and R1 stood at first"):
        camera.open()


def test_a_camera_in_use_is_told_so(rig):
    rig.camera.open()
    with pytest.raises(DeviceNotFound, match="end the other program that uses it"):
        rig.stereo(rig.settings).open()


# Pairs


def test_both_eyes_side_by_side_are_split(tmp_path):
    rig = UsbRig(tmp_path, is_side_by_side=True)
    rig.camera.open()
    frame = rig.camera.read(1.0)
    assert frame.left.shape == frame.right.shape == (HEIGHT, WIDTH, 3)
    assert rig.left.captures[-1].props[cv2.CAP_PROP_FRAME_WIDTH] == 2 * WIDTH
    assert np.unique(frame.right).item() == np.unique(frame.left).item() + 50
    assert frame.skew_ns == 0
    assert rig.camera.info.serials == ("L1", "L1")
    rig.camera.close()


def test_skew_and_rate_are_measured(rig):
    rig.right.offset_s = 0.0015
    rig.camera.open()
    frames = [rig.camera.read(1.0) for _ in range(10)]
    for frame in frames:
        assert frame.skew_ns == pytest.approx(1.5e6, abs=1e3)
    info = rig.camera.info
    assert info.measured_skew_ms == pytest.approx(1.5, abs=1e-3)
    gaps = np.diff([frame.captured_ns for frame in frames]) / 1e7
    assert np.abs(gaps - np.round(gaps)).max() < 1e-3  # multiples of the period, whoever is late
    assert info.measured_rate_hz == pytest.approx(9e2 / gaps.sum(), rel=1e-6)


def test_cameras_out_of_step_give_no_pair_and_the_message_says_why(rig):
    rig.right.offset_s = 0.0049
    rig.camera.open()
    error = fails_within(rig.camera, DeviceTimeout)
    while "apart" not in str(error):
        error = fails_within(rig.camera, DeviceTimeout)
    assert "ms apart: synchronise the cameras, or raise max_skew_ms" in str(error)
    assert rig.camera.info.n_unpaired > 2


def test_old_pictures_are_dropped_and_counted(rig):
    rig.left.late_s = 0.3
    rig.camera.open()
    with pytest.raises(DeviceTimeout):
        rig.camera.read(0.1)
    assert rig.camera.info.n_stale > 3
    rig.left.late_s = 0.0
    frame = rig.camera.read(1.0)
    assert frame.received_ns - frame.captured_ns < 250e6


def test_a_pair_that_nobody_took_in_time_is_not_handed_out(rig):
    rig.camera.open()
    rig.camera.read(1.0)
    time.sleep(0.05)
    rig.left.is_stalled = rig.right.is_stalled = True
    rig.left.stall_s = rig.right.stall_s = 1.0
    time.sleep(0.4)
    with pytest.raises(DeviceTimeout):
        rig.camera.read(0.0)
    assert rig.camera.info.n_stale == 1
    rig.left.is_plugged = rig.right.is_plugged = False


@pytest.mark.parametrize(("stamps", "source"), [("host", "the driver's clock"),
                                                ("own", "middle of the grab"),
                                                ("none", "middle of the grab")])  # fmt: skip
def test_where_capture_times_come_from_is_told(rig, stamps, source):
    rig.left.stamps = rig.right.stamps = stamps
    rig.camera.open()
    begin_ns = time.monotonic_ns()
    frame = rig.camera.read(1.0)
    assert begin_ns - 20e6 < frame.captured_ns <= frame.received_ns
    assert rig.camera.info.notes == tuple(f"{s}: capture time is {source}" for s in ("L1", "R1"))


def test_pictures_are_those_that_opencv_decodes(tmp_path):
    rig = UsbRig(tmp_path)
    for serial, eye in (("L1", "left"), ("R1", "right")):
        node = rig.bus.names.find(serial).node
        rig.bus.films[node] = write_video(tmp_path / f"{eye}.avi", (eye,), 12)
    eye = replace(rig.settings.eye, width=recordings.WIDTH, height=recordings.HEIGHT)
    camera = rig.stereo(replace(rig.settings, eye=eye))
    camera.open()
    frames = [camera.read(1.0) for _ in range(5)]
    fails_within(camera, DeviceLost)
    camera.close()
    for frame in frames:  # x.5: the right eye
        left, right = number_of(frame.left), number_of(frame.right)
        assert left % 1.0 == 0.0
        assert right % 1.0 == 0.5
    assert np.all(np.diff([number_of(frame.left) for frame in frames]) > 0)


# Faults


def test_an_unplugged_camera_is_lost_at_once_and_comes_back(rig):
    rig.camera.open()
    before = rig.camera.read(1.0)
    rig.bus.unplug(rig.right)
    begin_s = time.monotonic()
    error = fails_within(rig.camera, DeviceLost)
    assert time.monotonic() - begin_s < 1.0
    assert "R1 gives no more pictures" in str(error)
    rig.camera.close()
    with pytest.raises(DeviceNotFound, match="camera R1 is not connected"):
        rig.camera.open()
    assert rig.left.n_open == 0
    rig.bus.plug("R1", 5)
    rig.camera.open()
    assert rig.camera.read(1.0).sequence > before.sequence
    assert rig.camera.info.controls["exposure_ms"] == 5.0


def test_a_camera_that_never_gave_a_picture_is_told_so(rig):
    rig.right.is_stalled = True
    rig.camera.open()
    error = fails_within(rig.camera, DeviceLost)
    assert "R1 was opened but gives no picture: give each camera a USB controller" in str(error)


def test_a_stalled_camera_times_out_and_is_lost_after_three_of_the_drivers(rig):
    rig.right.stall_s = 0.15
    rig.camera.open()
    rig.camera.read(1.0)
    rig.right.is_stalled = True
    fails_within(rig.camera, DeviceTimeout)
    assert "R1 gives no more pictures" in str(fails_within(rig.camera, DeviceLost, 1.0))


def test_the_last_picture_for_ever_is_no_picture(rig):
    rig.camera.open()
    rig.camera.read(1.0)
    rig.left.is_frozen = True
    error = str(fails_within(rig.camera, DeviceLost))
    silent_s = re.search(r"L1 has given no new picture for (\d+) s", error)
    assert silent_s is not None, error
    assert int(silent_s[1]) >= 3  # longer on a busy machine


def test_a_grab_that_never_returns_blocks_neither_reading_nor_closing(rig):
    rig.camera.open()
    rig.camera.read(1.0)
    capture = rig.right.captures[-1]
    rig.right.is_hanging = True
    assert "R1 has given no new picture" in str(fails_within(rig.camera, DeviceLost))
    begin_s = time.monotonic()
    rig.camera.close()
    assert time.monotonic() - begin_s < 4.0
    rig.right.is_hanging = False
    capture.released.set()


def test_damaged_pictures_are_dropped_and_counted(rig):
    rig.right.is_damaged = True
    rig.camera.open()
    with pytest.raises(DeviceTimeout):
        rig.camera.read(0.1)
    assert rig.camera.info.n_stale > 3


def test_a_picture_of_another_size_ends_it(rig):
    rig.camera.open()
    rig.camera.read(1.0)
    rig.left.shape = (HEIGHT, 2 * WIDTH)
    error = fails_within(rig.camera, DeviceProtocolError)
    assert "L1 sent a picture of 128x48 where it had said 64x48" in str(error)


def test_a_reader_that_waits_ends_when_the_camera_is_closed(rig):
    rig.left.is_stalled = True
    rig.left.stall_s = 0.3
    rig.camera.open()
    caught = []

    def wait() -> None:
        try:
            rig.camera.read(5.0)
        except DeviceLost as error:
            caught.append(error)

    thread = threading.Thread(target=wait)
    thread.start()
    time.sleep(0.05)
    rig.camera.close()
    thread.join(1.0)
    assert "closed" in str(caught[0])
