"""An OAK camera booted with a pipeline that sends both mono pictures of an instant together."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import timedelta
from functools import partial
from typing import Any, Protocol

from drivers.depthai_package import import_depthai
from drivers.depthai_settings import DepthaiSettings
from navapp.errors import DeviceError, DeviceNotFound

# As the eyes are called in a group of messages.
EYES = ("left", "right")


class GroupQueue(Protocol):
    """The part of DepthAI's output queue that the driver uses."""

    def get(self, timeout: timedelta, /) -> Any:
        """The next group of messages by the names of `EYES`; None when none came in time."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class DepthaiParts:
    """What the driver needs of a booted camera: the lowest seam for a fake."""

    device_id: str  # its serial number
    usb_speed: str  # as DepthAI names it
    boot_s: float  # how long the boot took
    queue: GroupQueue  # of pairs, the newest only
    calibration: Any  # its `CalibrationHandler`
    send_exposure: Callable[[float, float], None]  # asks both eyes for ms and ISO
    # brightness of `ir_dots` or `ir_flood`; whether it was taken.
    set_infrared: Callable[[str, float], bool]
    # ends pipeline and connection; the camera then starts anew, for some seconds.
    close: Callable[[], None]


def open_parts(settings: DepthaiSettings) -> DepthaiParts:
    """Find, boot and start a camera.

    Raises:
        DeviceNotFound: no package, no such camera, or it does not boot.
        DeviceError: it has no mono pair, or refuses the pipeline.
    """
    dai = import_depthai()
    info = _find_device(settings.device)
    begin_s = time.monotonic()
    with ExitStack() as undo:
        try:
            device = dai.Device(info)
        except RuntimeError as error:
            raise DeviceNotFound(
                f"OAK camera {info.getDeviceId()} does not boot ({error})",
                subject=settings.device,
                remedy="end other programs that use it, or plug it in again",
            ) from error
        undo.callback(device.close)
        try:
            device.setMaxReconnectionAttempts(0)  # who reads decides when it is opened again
            pipeline = dai.Pipeline(device)
            undo.callback(stop, pipeline)
            queue, controls = _build(pipeline, settings)
            pipeline.start()
            return DepthaiParts(
                device.getDeviceId(),
                device.getUsbSpeed().name,
                time.monotonic() - begin_s,
                queue,
                device.readCalibration(),
                partial(_send_exposure, controls),
                partial(_set_infrared, device),
                undo.pop_all().close,
            )
        except RuntimeError as error:
            raise DeviceError(
                f"OAK camera {info.getDeviceId()} refuses its pipeline ({error})",
                subject=settings.device,
                remedy="ask for a size and rate that its mono cameras have",
            ) from error


def _find_device(device_id: str) -> Any:
    """Description of the wanted camera on USB; the network is never searched."""
    dai = import_depthai()
    try:
        infos = dai.Device.getAllAvailableDevices()
    except RuntimeError:
        infos = []
    names = [info.getDeviceId() for info in infos]
    wanted = [info for info in infos if device_id in ("", info.getDeviceId())]
    if len(wanted) == 1:
        wanted[0].protocol = dai.XLinkProtocol.X_LINK_USB_VSC
        return wanted[0]
    if wanted:
        raise DeviceNotFound(
            f"{len(wanted)} OAK cameras are connected: {', '.join(names)}",
            subject="camera.depthai.device",
            remedy="name one of them",
        )
    raise DeviceNotFound(
        f"OAK camera {device_id} is not connected (connected: {', '.join(names) or 'none'})"
        if device_id
        else "no OAK camera is connected",
        subject=device_id,
        remedy="plug it in, on Linux with a udev rule for vendor 03e7; after closing it starts "
        "anew for some seconds",
    )


def _build(pipeline: Any, settings: DepthaiSettings) -> tuple[GroupQueue, list[Any]]:
    """Nodes from both eyes to one queue of pairs, and the control queues of the eyes."""
    dai = import_depthai()
    sync = pipeline.create(dai.node.Sync)
    sync.setSyncThreshold(timedelta(milliseconds=settings.max_skew_ms))
    # The left eye gives the signal on which the right one exposes.
    modes = (dai.CameraControl.FrameSyncMode.OUTPUT, dai.CameraControl.FrameSyncMode.INPUT)
    sockets = (dai.CameraBoardSocket.CAM_B, dai.CameraBoardSocket.CAM_C)
    size, rate_hz = (settings.width, settings.height), settings.rate_hz
    controls = []
    for eye, socket, mode in zip(EYES, sockets, modes, strict=True):
        camera = pipeline.create(dai.node.Camera).build(socket, sensorFps=rate_hz)
        camera.initialControl.setFrameSyncMode(mode)
        _lock(camera.initialControl, settings.controls["exposure_ms"], settings.controls["iso"])
        output = camera.requestOutput(size, dai.ImgFrame.Type.GRAY8, fps=rate_hz)
        output.link(sync.inputs[eye])
        controls.append(camera.inputControl.createInputQueue())
    return sync.out.createOutputQueue(maxSize=1, blocking=False), controls


def _lock(control: Any, exposure_ms: float, iso: float) -> None:
    control.setManualExposure(round(exposure_ms * 1e3), round(iso))


def _send_exposure(queues: list[Any], exposure_ms: float, iso: float) -> None:
    for queue in queues:
        message = import_depthai().CameraControl()
        _lock(message, exposure_ms, iso)
        queue.send(message)


def _set_infrared(device: Any, lamp: str, brightness: float) -> bool:
    if lamp == "ir_dots":
        return bool(device.setIrLaserDotProjectorIntensity(brightness))
    return bool(device.setIrFloodLightIntensity(brightness))


def stop(pipeline: Any) -> None:
    """End a pipeline; without the wait the interpreter crashes at its exit."""
    pipeline.stop()
    pipeline.wait()
