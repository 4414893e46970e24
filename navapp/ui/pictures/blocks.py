"""Pictures as half blocks, written past Textual, which keeps the tracker waiting for so many."""

import numpy as np
from numpy.typing import NDArray

from navapp.ui.pictures.block_kernels import count_most_bytes, encode_blocks

# A half block is as wide as high: the pixels of these pictures.
CELL_PX = (1, 2)


class BlockEncoder:
    """Writes pictures as half blocks.

    Args:
        is_true_colour: the terminal has more than 256 colours.
    """

    is_scaled_by_terminal = False
    is_busy = False
    has_pixels = False

    def __init__(self, *, is_true_colour: bool) -> None:
        self._is_true_colour = is_true_colour
        self._text = np.empty(0, np.uint8)

    def encode(self, number: int, picture: NDArray[np.uint8], columns: int, rows: int) -> str:
        """What draws (2 rows, columns, 3) BGR at the cursor; the number does not matter."""
        if len(self._text) < count_most_bytes(rows, columns):
            self._text = np.empty(count_most_bytes(rows, columns), np.uint8)
        n = encode_blocks(picture, self._is_true_colour, self._text)
        return self._text[:n].tobytes().decode()

    def erase(self, number: int) -> str:
        """Nothing: text that is written there replaces it."""
        return ""

    def close(self) -> None:
        """Nothing is kept anywhere."""
