"""Converts the calibration stored in an OAK camera to a rig."""

from typing import Any

import numpy as np

from drivers.depthai_package import import_depthai
from navapp.errors import RigError
from navapp.geometry.camera import Camera
from navapp.geometry.rig import RigQuality, StereoRig
from navapp.geometry.transform import RigidTransform

_QUALITY = RigQuality(
    is_accepted=False, reasons=("the factory's calibration: nobody has checked it here",)
)


def make_factory_rig(handler: Any, width: int, height: int, device_id: str) -> StereoRig:
    """The mono pair as calibrated by the maker, marked as not accepted.

    This is the one place where the maker's centimetres become mm: the handler is asked for them.

    Args:
        handler: a `CalibrationHandler`.
        width: of the pictures that are asked for; the handler scales, then crops.
        height: the same.
        device_id: serial number of both eyes.

    Raises:
        RigError: no calibration, or one that no rig can have.
    """
    dai = import_depthai()
    left, right = dai.CameraBoardSocket.CAM_B, dai.CameraBoardSocket.CAM_C
    try:
        cameras = [_camera(handler, socket, width, height) for socket in (left, right)]
        # From the calibration, not from the board's drawing (useSpecTranslation).
        matrix = handler.getCameraExtrinsics(left, right, False, dai.LengthUnit.MILLIMETER)
        right_from_left = RigidTransform("right", "left", np.array(matrix, dtype=np.float64))
        return StereoRig(
            cameras[0],
            cameras[1],
            right_from_left,
            (device_id, device_id),
            _QUALITY,
            f"factory:{device_id}",
        )
    except (RuntimeError, ValueError, IndexError) as error:
        raise RigError(
            f"OAK camera {device_id} carries no usable calibration ({error})",
            subject=device_id,
            remedy="calibrate it: navapp calibrate capture",
        ) from error


def _camera(handler: Any, socket: Any, width: int, height: int) -> Camera:
    model = handler.getDistortionModel(socket)
    if model != import_depthai().CameraModel.Perspective:
        raise ValueError(f"a {model.name} lens")
    matrix = np.array(handler.getCameraIntrinsics(socket, width, height), dtype=np.float64)
    distortion = np.array(handler.getDistortionCoefficients(socket), dtype=np.float64)
    return Camera(matrix, distortion, width, height)
