"""Settings of an OAK camera."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from navapp.errors import UsageError

_CONTROLS = {"exposure_ms": 5.0, "iso": 200.0, "ir_dots": 0.0, "ir_flood": 0.0}


@dataclass(frozen=True, slots=True)
class DepthaiSettings:
    """Which OAK camera, and its settings.

    Raises:
        UsageError: values that no camera has.
    """

    device: str = ""  # its id; empty when only one is connected
    # width, height: of one picture, px.
    width: int = 1280
    height: int = 720
    rate_hz: float = 15.0  # pairs in a second
    # `exposure_ms` and `iso`, locked for both eyes, `ir_dots` and `ir_flood`, the brightness of the
    # infrared projectors from 0 (off) to 1; those left out have defaults.
    controls: Mapping[str, float] = field(default_factory=dict)
    max_skew_ms: float = 1.0  # pictures that are farther apart make no pair
    max_age_ms: float = 250.0  # an older pair is dropped

    def __post_init__(self) -> None:
        is_rate = math.isfinite(self.rate_hz) and self.rate_hz > 0.0
        if self.width <= 0 or self.height <= 0 or not is_rate:
            raise UsageError("size and rate of an OAK camera must be positive")
        object.__setattr__(self, "controls", {**_CONTROLS, **self.controls})
        for name, value in self.controls.items():
            low, high = self.limits()[name]
            if not low <= value <= high:
                raise UsageError(
                    f"{name} of an OAK camera cannot be {value:g}",
                    subject=name,
                    remedy=f"use {low:g} to {high:g}",
                )

    def limits(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest value of every control."""
        return {
            "exposure_ms": (0.02, 1000.0 / self.rate_hz),
            "iso": (100.0, 1600.0),
            "ir_dots": (0.0, 1.0),
            "ir_flood": (0.0, 1.0),
        }
