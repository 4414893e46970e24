"""Compiled census transform."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def census_rows(
    image: NDArray[np.uint8],
    radius_x: int,
    radius_y: int,
    first_row: int,
    last_row: int,
    codes: NDArray[np.uint64],
) -> None:
    """One bit for each neighbour: is it darker than the centre?

    Args:
        image: (h + 2 radius_y, w + 2 radius_x) grey values with a margin.
        radius_x: of the window; the window has at most 65 pixels.
        radius_y: of the window.
        first_row: of the rows of `codes` to fill.
        last_row: after them.
        codes: (h, w) in place; neighbours row by row, the first in the highest bit.
    """
    width = codes.shape[1]
    for y in range(first_row, last_row):
        for x in range(width):
            codes[y, x] = 0
        # The window's places outside, the pixels inside: the inner loop runs along memory.
        for dy in range(2 * radius_y + 1):
            for dx in range(2 * radius_x + 1):
                if dy == radius_y and dx == radius_x:
                    continue
                for x in range(width):
                    is_darker = image[y + dy, x + dx] < image[y + radius_y, x + radius_x]
                    codes[y, x] = (codes[y, x] << np.uint64(1)) | np.uint64(is_darker)
