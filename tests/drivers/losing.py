"""Waiting for the error that must come."""

import time
from typing import TypeVar

from drivers.interfaces import StereoCamera
from navapp.errors import DeviceError, DeviceTimeout

E = TypeVar("E", bound=DeviceError)


def fails_within(
    camera: StereoCamera, error: type[E], limit_s: float = 8.0, timeout_s: float = 0.05
) -> E:
    """Read until that error comes; frames and time-outs may come before it."""
    begin_s = time.monotonic()
    while time.monotonic() - begin_s < limit_s:
        try:
            camera.read(timeout_s)
        except error as found:
            return found
        except DeviceTimeout:
            continue
    raise AssertionError(f"no {error.__name__} within {limit_s} s")
