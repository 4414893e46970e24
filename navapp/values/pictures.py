"""What a display is to show."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class OverlayMode(Enum):
    """Over the video, or alone on black for the half-silvered mirror."""

    VIDEO = "video"
    MIRROR = "mirror"


@dataclass(frozen=True, slots=True, eq=False)
class OverlayPicture:
    """A picture to be shown until it expires: (H, W, 3) uint8 BGR."""

    image: NDArray[np.uint8]
    valid_until_ns: int
    mode: OverlayMode
    pose_age_ns: int
