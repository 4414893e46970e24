"""Converts a group of DepthAI's messages to two pictures with their times."""

from dataclasses import dataclass
from datetime import timedelta
from typing import Any

import numpy as np

from drivers.depthai_package import import_depthai
from drivers.depthai_parts import EYES
from drivers.frames import Image
from navapp.errors import DeviceProtocolError


@dataclass(frozen=True, slots=True, eq=False)
class DepthaiPair:
    """Two pictures of one message group, with their times, exposure and sensitivity."""

    # left, right: (H, W) uint8, arrays of their own.
    left: Image
    right: Image
    captured_ns: int  # mid exposure of the left one, mapped to the host's clock by DepthAI
    # right minus left on the camera's own clock, which is common to both and is not corrected
    # between two pictures.
    skew_ns: int
    # exposure_ms, iso: with which the left picture was taken.
    exposure_ms: float
    iso: float


def pair_of(group: Any, shape: tuple[int, int], device_id: str) -> DepthaiPair:
    """Read both messages of a group.

    Args:
        group: messages by the names of `EYES`.
        shape: (H, W) that the pictures must have.
        device_id: of the camera, for the message.

    Raises:
        DeviceProtocolError: a picture of another size.
    """
    middle = import_depthai().CameraExposureOffset.MIDDLE
    left, right = (group[eye] for eye in EYES)
    device_ns = [_ns(message.getTimestampDevice(middle)) for message in (left, right)]
    pictures = [np.asarray(message.getFrame(), dtype=np.uint8) for message in (left, right)]
    for picture in pictures:
        if picture.shape != shape:
            raise DeviceProtocolError(
                f"OAK camera {device_id} sent a picture of shape {picture.shape} "
                f"where {shape} was asked for",
                subject=device_id,
                remedy="ask for a size that its mono cameras have",
            )
    return DepthaiPair(
        pictures[0],
        pictures[1],
        _ns(left.getTimestamp(middle)),
        device_ns[1] - device_ns[0],
        _ns(left.getExposureTime()) * 1e-6,
        float(left.getSensitivity()),
    )


def _ns(time: timedelta) -> int:
    return time // timedelta(microseconds=1) * 1000
