"""Boot and pipeline of an OAK camera, on a stand-in that has the package's own names only."""

from types import SimpleNamespace
from unittest.mock import MagicMock, Mock

import pytest

import drivers.depthai_parts
from drivers.depthai_parts import open_parts
from drivers.depthai_settings import DepthaiSettings
from navapp.errors import DeviceError, DeviceNotFound

dai = pytest.importorskip("depthai", reason="the package depthai is not installed (navapp[oak])")

# What is only data is taken from the package.
DATA = ("CameraBoardSocket", "CameraControl", "ImgFrame", "UsbSpeed", "XLinkProtocol")


class StandIn:
    """The module, the calls in order, and a camera that is connected."""

    def __init__(self) -> None:
        self.calls = Mock()
        self.device = Mock(spec=dai.Device)
        self.device.getDeviceId.return_value = "OAK-1"
        self.device.getUsbSpeed.return_value = dai.UsbSpeed.SUPER
        self.pipeline = MagicMock(spec=dai.Pipeline)
        self.nodes = [MagicMock(spec=kind) for kind in (dai.node.Sync, *[dai.node.Camera] * 2)]
        self.sync, *self.eyes = self.nodes
        self.sync.configure_mock(inputs={"left": "L", "right": "R"}, out=Mock())
        for eye in self.eyes:
            eye.build.return_value = eye
            eye.configure_mock(initialControl=Mock(spec=dai.CameraControl), inputControl=Mock())
        self.pipeline.create.side_effect = self.nodes
        self.calls.attach_mock(self.device, "device")
        self.calls.attach_mock(self.pipeline, "pipeline")
        self.infos = [Mock(spec=dai.DeviceInfo, getDeviceId=Mock(return_value="OAK-1"))]
        make = Mock(return_value=self.device)
        make.getAllAvailableDevices = Mock(side_effect=lambda: self.infos)
        self.make = make
        self.module = SimpleNamespace(
            Device=make,
            Pipeline=Mock(return_value=self.pipeline),
            node=dai.node,
            **{name: getattr(dai, name) for name in DATA},
        )


@pytest.fixture
def oak(monkeypatch):
    oak = StandIn()
    monkeypatch.setattr(drivers.depthai_parts, "import_depthai", lambda: oak.module)
    return oak


def test_the_right_eye_exposes_on_the_left_ones_signal(oak):
    settings = DepthaiSettings("OAK-1", 1280, 720, 20.0, {"exposure_ms": 4.0, "iso": 300.0})
    parts = open_parts(settings)
    mode = dai.CameraControl.FrameSyncMode
    sockets = dai.CameraBoardSocket.CAM_B, dai.CameraBoardSocket.CAM_C
    for eye, socket, sync in zip(oak.eyes, sockets, (mode.OUTPUT, mode.INPUT), strict=True):
        eye.build.assert_called_once_with(socket, sensorFps=20.0)
        eye.initialControl.setFrameSyncMode.assert_called_once_with(sync)
        eye.initialControl.setManualExposure.assert_called_once_with(4000, 300)
        size, kind = eye.requestOutput.call_args.args
        assert (size, kind) == ((1280, 720), dai.ImgFrame.Type.GRAY8)
    linked = [eye.requestOutput.return_value.link.call_args.args[0] for eye in oak.eyes]
    assert linked == ["L", "R"]
    oak.sync.out.createOutputQueue.assert_called_once_with(maxSize=1, blocking=False)
    assert (parts.device_id, parts.usb_speed) == ("OAK-1", "SUPER")
    assert oak.infos[0].protocol == dai.XLinkProtocol.X_LINK_USB_VSC
    oak.device.setMaxReconnectionAttempts.assert_called_once_with(0)


def test_exposure_goes_to_both_eyes_and_each_lamp_has_its_own_call(oak):
    parts = open_parts(DepthaiSettings())
    parts.send_exposure(2.0, 400.0)
    for eye in oak.eyes:
        (message,) = eye.inputControl.createInputQueue.return_value.send.call_args.args
        assert message.getExposureTime().total_seconds() == pytest.approx(2e-3)
        assert message.getSensitivity() == 400
    oak.device.setIrLaserDotProjectorIntensity.return_value = False
    assert parts.set_infrared("ir_dots", 0.5) is False
    assert parts.set_infrared("ir_flood", 0.25) is True
    oak.device.setIrFloodLightIntensity.assert_called_once_with(0.25)


def ends(oak) -> list[str]:
    return [
        name for name, *_ in oak.calls.mock_calls
        if name in ("pipeline.stop", "pipeline.wait", "device.close")
    ]  # fmt: skip


def test_closing_stops_waits_and_closes_in_that_order(oak):
    parts = open_parts(DepthaiSettings())
    assert ends(oak) == []
    parts.close()
    assert ends(oak) == ["pipeline.stop", "pipeline.wait", "device.close"]


def test_a_refused_pipeline_is_told_and_nothing_stays_open(oak):
    oak.pipeline.start.side_effect = RuntimeError("no such resolution")
    with pytest.raises(DeviceError, match=r"OAK-1 refuses its pipeline \(no such resolution\)"):
        open_parts(DepthaiSettings())
    assert ends(oak) == ["pipeline.stop", "pipeline.wait", "device.close"]


def test_a_camera_that_does_not_boot_is_told(oak):
    oak.make.side_effect = RuntimeError("X_LINK_ERROR")
    with pytest.raises(DeviceNotFound, match=r"OAK-1 does not boot .*end other programs"):
        open_parts(DepthaiSettings())


def test_one_of_two_cameras_must_be_named(oak):
    oak.infos.append(Mock(spec=dai.DeviceInfo, getDeviceId=Mock(return_value="OAK-2")))
    with pytest.raises(DeviceNotFound, match="2 OAK cameras are connected: OAK-1, OAK-2"):
        open_parts(DepthaiSettings())
    open_parts(DepthaiSettings("OAK-2"))
    assert oak.make.call_args.args == (oak.infos[1],)


def test_an_absent_camera_is_told_beside_those_that_are_there(oak):
    with pytest.raises(DeviceNotFound, match=r"ID is not connected \(connected: OAK-1\)"):
        open_parts(DepthaiSettings("ID"))
