"""Pictures as sixels, for terminals like xterm."""

import numpy as np
from numpy.typing import NDArray

from navapp.ui.pictures.sixel_kernels import (
    N_COLOURS,
    N_LEVELS,
    count_most_bytes,
    encode_sixels,
    find_colours,
)

# What no sixel covers stays as it is.
_START, _END = "\x1bP0;1q", "\x1b\\"


def _define_colours() -> str:
    """The colour cube; channels in percent."""
    percent = [round(100 * level / (N_LEVELS - 1)) for level in range(N_LEVELS)]
    cube = [(red, green, blue) for red in percent for green in percent for blue in percent]
    return "".join(f"#{k};2;{red};{green};{blue}" for k, (red, green, blue) in enumerate(cube))


class SixelEncoder:
    """Writes pictures as sixels in 216 colours, dithered."""

    has_pixels = True
    # The terminal draws pixel for pixel.
    is_scaled_by_terminal = False
    # What was sent is drawn when it has been read.
    is_busy = False

    def __init__(self) -> None:
        self._colours = _define_colours()
        self._width = 0
        self._text = np.empty(0, np.uint8)

    def encode(self, number: int, picture: NDArray[np.uint8], columns: int, rows: int) -> str:
        """What draws (h, w, 3) BGR at the cursor; number and cells do not matter."""
        height, width = picture.shape[:2]
        if width != self._width:
            self._columns = np.zeros((N_COLOURS, width), np.int16)
            self._sixels = np.zeros((N_COLOURS, width), np.uint8)
            self._width = width
        if len(self._text) < count_most_bytes(height, width):
            self._text = np.empty(count_most_bytes(height, width), np.uint8)
        indexes = np.empty((height, width), np.uint8)
        find_colours(picture, indexes)
        n = encode_sixels(indexes, self._columns, self._sixels, self._text)
        size = f'"1;1;{width};{height}'
        return f"{_START}{size}{self._colours}{self._text[:n].tobytes().decode('ascii')}{_END}"

    def erase(self, number: int) -> str:
        """Nothing: text that is written there erases it."""
        return ""

    def close(self) -> None:
        """Nothing is kept anywhere."""
