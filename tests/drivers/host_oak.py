"""OAK cameras without hardware: DepthAI's own pipeline, queues and messages on the host."""

import time
from contextlib import ExitStack
from datetime import timedelta
from functools import partial

import numpy as np
import pytest

from drivers.depthai_parts import EYES, DepthaiParts, stop
from drivers.depthai_settings import DepthaiSettings
from navapp.errors import DeviceNotFound

dai = pytest.importorskip("depthai", reason="the package depthai is not installed (navapp[oak])")

WIDTH, HEIGHT, RATE_HZ = 64, 48, 100.0
BASELINE_CM = 7.5
# The camera's clock began elsewhere.
DEVICE_OFFSET = timedelta(seconds=1234)


def calibration(turn_deg: float = 0.0) -> dai.CalibrationHandler:
    """As a maker's table would write it: K at 1280x800, 14 coefficients, centimetres."""
    angle = np.radians(turn_deg)
    rotation = [
        [np.cos(angle), 0.0, np.sin(angle)],
        [0.0, 1.0, 0.0],
        [-np.sin(angle), 0.0, np.cos(angle)],
    ]
    left, right = dai.CameraBoardSocket.CAM_B, dai.CameraBoardSocket.CAM_C
    handler = dai.CalibrationHandler()
    for socket, focal_px in ((left, 800.0), (right, 801.0)):
        K = [[focal_px, 0.0, 640.0], [0.0, focal_px, 400.0], [0.0, 0.0, 1.0]]
        handler.setCameraIntrinsics(socket, K, 1280, 800)
        handler.setDistortionCoefficients(socket, [0.1, -0.05, 0.001, 0.002, 0.01] + [0.0] * 9)
    offset_cm = [-BASELINE_CM, 0.0, 0.0]
    handler.setCameraExtrinsics(left, right, rotation, offset_cm, [-99.0, 0.0, 0.0])
    handler.setStereoLeft(left, np.eye(3).tolist())
    handler.setStereoRight(right, np.eye(3).tolist())
    return handler


class HostOak:
    """A camera on the bus; tests change it while it runs."""

    def __init__(self, device_id: str = "14442C10D13EABCE00") -> None:
        self.device_id = device_id
        self.is_plugged = True
        self.is_stalled = False
        self.is_deaf = False
        self.usb_speed = "SUPER"
        self.lamps = {"ir_dots", "ir_flood"}
        self.skew = timedelta(0)
        self.age = timedelta(milliseconds=4)
        self.shape = (HEIGHT, WIDTH)
        self.handler = calibration()
        self.exposure_ms = 0.0
        self.iso = 0.0
        self.n_absent = 0
        self.queue: dai.MessageQueue | None = None

    def open_parts(self, settings: DepthaiSettings) -> DepthaiParts:
        if not self.is_plugged or settings.device not in ("", self.device_id):
            raise DeviceNotFound("no OAK camera is connected")
        if self.n_absent:
            self.n_absent -= 1
            raise DeviceNotFound("no OAK camera is connected")
        self.send_exposure(settings.controls["exposure_ms"], settings.controls["iso"])
        with ExitStack() as undo:
            pipeline = dai.Pipeline(createImplicitDevice=False)
            undo.callback(stop, pipeline)
            sync = pipeline.create(dai.node.Sync)
            sync.setRunOnHost(True)
            sync.setSyncThreshold(timedelta(milliseconds=5))
            for number, eye in enumerate(EYES):
                source = pipeline.create(_Eye)
                source.set_up(self, number, settings.rate_hz)
                source.out.link(sync.inputs[eye])
            queue = self.queue = sync.out.createOutputQueue(maxSize=1, blocking=False)
            pipeline.start()
            return DepthaiParts(
                self.device_id,
                self.usb_speed,
                2.5,
                _Telling(self, queue),
                self.handler,
                self.send_exposure,
                self.set_infrared,
                undo.pop_all().close,
            )

    def send_exposure(self, exposure_ms: float, iso: float) -> None:
        self.require_link()
        if self.is_deaf:
            return
        # Sensors expose in whole lines.
        self.exposure_ms, self.iso = round(exposure_ms / 0.03) * 0.03, iso

    def set_infrared(self, lamp: str, brightness: float) -> bool:
        self.require_link()
        return lamp in self.lamps

    def require_link(self) -> None:
        """DepthAI's queues and calls fail so when nobody is at the other end any more."""
        if not self.is_plugged:
            raise dai.MessageQueue.QueueException("closed")

    def unplug(self) -> None:
        """A lost link closes the queue under the reader."""
        self.is_plugged = False
        assert self.queue is not None
        self.queue.close()


class _Eye(dai.node.ThreadedHostNode):
    def __init__(self) -> None:
        super().__init__()
        self.out = self.createOutput()

    def set_up(self, oak: HostOak, number: int, rate_hz: float) -> None:
        self.oak, self.number, self.period_s = oak, number, 1.0 / rate_hz

    def run(self) -> None:
        n = int(time.monotonic() / self.period_s)
        while self.mainLoop():
            n = max(n + 1, int(time.monotonic() / self.period_s))
            time.sleep(max(0.0, n * self.period_s - time.monotonic()))
            if not self.oak.is_stalled:
                self.out.send(self.message(n))

    def message(self, n: int) -> dai.ImgFrame:
        frame = dai.ImgFrame()
        picture = np.full(self.oak.shape, n % 200 + 50 * self.number, np.uint8)
        frame.setCvFrame(picture, dai.ImgFrame.Type.GRAY8)
        taken = timedelta(seconds=n * self.period_s) - self.oak.age
        frame.setTimestamp(taken)
        frame.setTimestampDevice(taken + DEVICE_OFFSET + self.oak.skew * self.number)
        frame.setSequenceNum(n + self.number)  # eyes may count apart by one
        return frame


class _Telling:
    """A host's messages have no exposure of their own: it is added as the camera would tell it."""

    def __init__(self, oak: HostOak, queue: object) -> None:
        self.oak, self.queue = oak, queue

    def get(self, timeout: timedelta) -> dict[str, object] | None:
        group = self.queue.get(timeout)
        if group is None:
            return None
        return {eye: _Told(group[eye], self.oak) for eye in EYES}


class _Told:
    def __init__(self, message: object, oak: HostOak) -> None:
        self._message = message
        self.getExposureTime = partial(timedelta, milliseconds=oak.exposure_ms)
        self.getSensitivity = partial(int, oak.iso)

    def __getattr__(self, name: str) -> object:
        return getattr(self._message, name)
