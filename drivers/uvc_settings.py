"""Settings of a USB camera."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from navapp.errors import UsageError


@dataclass(frozen=True, slots=True)
class UvcSettings:
    """Format and controls of a camera; both eyes of a pair have the same.

    Raises:
        UsageError: values that mean nothing.
    """

    fourcc: str = "MJPG"  # pixel format; two cameras on one USB 2 line need a compressed one
    # width, height: of the picture that the camera sends, px.
    width: int = 1280
    height: int = 720
    rate_hz: float = 30.0  # pictures in a second
    # `exposure_ms` (in steps of 0.1, at most the frame period), `gain`, `white_balance_k` and
    # `focus` (another one than at the calibration voids the rig); those left out stay where the
    # camera has them, without their automatic.
    controls: Mapping[str, float] = field(default_factory=dict)
    max_age_ms: float = 250.0  # a picture that is older when it is grabbed or read is dropped

    def __post_init__(self) -> None:
        if len(self.fourcc) != 4 or not self.fourcc.isascii():
            raise UsageError(f"{self.fourcc!r} is no pixel format", remedy="use MJPG or YUYV")
        if not (math.isfinite(self.rate_hz) and self.rate_hz > 0.0):
            raise UsageError(f"a rate of {self.rate_hz:g} Hz is none", remedy="use a positive rate")
        if self.width <= 0 or self.height <= 0 or not self.max_age_ms > 0.0:
            raise UsageError("size and greatest age of a camera's pictures must be positive")
