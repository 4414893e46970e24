"""What a display is to show, and what a simulated eye sees of it."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from navapp.values.measured import Origin

# What a simulated eye sees now, and the same without the display's light; (H, W, 3) uint8 BGR each.
Look = Callable[[], tuple[NDArray[np.uint8], NDArray[np.uint8]]]
# (h, w, 3) uint8 BGR that it sees around a corner of a board (its id; None: around the board's
# middle) at its look of that number.
EyeLook = Callable[[int | None, int], NDArray[np.uint8]]

# BGR by which an operator's picture tells matched depth from guesses, by the side of their source.
DEPTH_COLOURS = MappingProxyType(
    {
        Origin.MATCHED: (200, 150, 60),
        Origin.FILLED_BORDER: (210, 80, 210),
        Origin.FILLED_INTERIOR: (40, 130, 250),
        Origin.MISMATCH_FILLED: (70, 220, 240),
        Origin.UNKNOWN: (110, 110, 110),
    }
)


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
