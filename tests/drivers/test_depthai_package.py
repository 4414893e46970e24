import sys

import pytest

from drivers.clock import SystemClock
from drivers.depthai_settings import DepthaiSettings
from drivers.depthai_stereo import DepthaiStereo
from navapp.errors import DeviceNotFound


def test_without_the_package_a_sentence_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "depthai", None)
    camera = DepthaiStereo(DepthaiSettings(), SystemClock())
    assert camera.info.name == "depthai:oak"
    with pytest.raises(DeviceNotFound, match=r"need the package depthai .*navapp\[oak\]"):
        camera.open()
    camera.close()


def test_without_a_camera_a_sentence_says_what_to_do():
    dai = pytest.importorskip("depthai")
    try:
        if dai.Device.getAllAvailableDevices():
            pytest.skip("an OAK camera is connected")
    except RuntimeError:
        pass
    with pytest.raises(DeviceNotFound, match=r"no OAK camera is connected: plug it in, on Linux"):
        DepthaiStereo(DepthaiSettings(), SystemClock()).open()
    with pytest.raises(DeviceNotFound, match=r"ID is not connected \(connected: none\)"):
        DepthaiStereo(DepthaiSettings("ID"), SystemClock()).open()
