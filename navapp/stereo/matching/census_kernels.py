"""Compiled census transform."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def add_bits(
    neighbours: NDArray[np.uint8], centres: NDArray[np.uint8], codes: NDArray[np.uint8]
) -> None:
    """Push one bit into each code of a row: is the neighbour darker? All (w,)."""
    for x in range(codes.shape[0]):
        codes[x] = np.uint8(codes[x] << 1) | np.uint8(neighbours[x] < centres[x])


@njit(cache=True, nogil=True)
def census_rows(
    image: NDArray[np.uint8],
    radius_x: int,
    radius_y: int,
    rows: tuple[int, int],
    codes: NDArray[np.uint8],
) -> None:
    """One bit for each neighbour: is it darker than the centre?

    Args:
        image: (h + 2 radius_y, w + 2 radius_x) grey values with a margin.
        radius_x: of the window.
        radius_y: of the window.
        rows: first, and after the last, of `codes` to fill.
        codes: (h, bytes, w) in place; neighbours row by row, eight in a byte, the first in the
            highest bit, the last byte filled up with zeros in front.
    """
    width = codes.shape[2]
    n_columns = 2 * radius_x + 1
    n_places = n_columns * (2 * radius_y + 1)
    for y in range(rows[0], rows[1]):
        codes[y] = 0
        centres = image[y + radius_y, radius_x : radius_x + width]
        number = 0
        # The window's places outside, the pixels inside: the inner loop runs along memory.
        for place in range(n_places):
            if place == n_places // 2:
                continue
            dx = place % n_columns
            neighbours = image[y + place // n_columns, dx : dx + width]
            add_bits(neighbours, centres, codes[y, number // 8])
            number += 1
