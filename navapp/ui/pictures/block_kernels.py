"""Turns a picture into the text of half blocks: two pixels a character."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.ui.pictures.number_kernels import write_number

# Of a channel in true colour: longer runs, hardly seen.
LEVELS = 15
# Of the 256 colours: a cube of 6 levels a channel, then 24 greys.
_CUBE = np.array([0, 95, 135, 175, 215, 255])
_FIRST_OF_CUBE, _FIRST_GREY, _N_GREYS, _DARKEST_GREY, _GREY_STEP = 16, 232, 24, 8, 10
_NEAREST = np.abs(np.arange(256)[:, None] - _CUBE).argmin(axis=1)
# The upper half block, in UTF-8.
_BLOCK = (0xE2, 0x96, 0x80)
_ESCAPE, _BRACKET, _SEMICOLON, _M, _DOWN, _LEFT, _SPACE = (ord(c) for c in "\x1b[;mBD ")


def count_most_bytes(rows: int, columns: int) -> int:
    """More than any picture of so many characters takes."""
    return rows * (columns * 48 + 16) + 16


@njit(cache=True, nogil=True)
def encode_blocks(picture: NDArray[np.uint8], is_true_colour: bool, text: NDArray[np.uint8]) -> int:
    """Write the characters of a picture from the cursor on, row below row; their length.

    Args:
        picture: (h, w, 3) BGR, h even.
        is_true_colour: else of the 256 colours the nearest.
        text: room for `count_most_bytes`.
    """
    height, width = picture.shape[:2]
    n: int = 0
    above, below = -1, -1
    for y in range(0, height, 2):
        if y:
            # A row down, and back to its first character.
            n = _write_escape(text, n)
            text[n] = _DOWN
            n = write_number(width, text, _write_escape(text, n + 1))
            text[n] = _LEFT
            n += 1
        for x in range(width):
            upper = _find_colour(picture[y, x], is_true_colour)
            lower = _find_colour(picture[y + 1, x], is_true_colour)
            if lower != below:
                n = _write_colour(48, lower, is_true_colour, text, n)
                below = lower
            if upper == lower:
                text[n] = _SPACE
                n += 1
                continue
            if upper != above:
                n = _write_colour(38, upper, is_true_colour, text, n)
                above = upper
            for k in range(3):
                text[n + k] = _BLOCK[k]
            n += 3
    n = _write_escape(text, n)
    text[n] = _M
    return n + 1


@njit(cache=True, nogil=True)
def _find_colour(pixel: NDArray[np.uint8], is_true_colour: bool) -> int:
    """A number for a colour: levels of red, green, blue, or its place among the 256."""
    blue, green, red = int(pixel[0]), int(pixel[1]), int(pixel[2])
    if is_true_colour:
        colour = 0
        for channel in (red, green, blue):
            colour = (colour << 4) | (channel * LEVELS + 127) // 255
        return int(colour)
    place, off = 0, 0
    for channel in (red, green, blue):
        level = _NEAREST[channel]
        place = 6 * place + level
        off += (_CUBE[level] - channel) ** 2
    mean = (red + green + blue) // 3
    grey = min(max((mean - _DARKEST_GREY + _GREY_STEP // 2) // _GREY_STEP, 0), _N_GREYS - 1)
    value = _DARKEST_GREY + _GREY_STEP * grey
    grey_off = (value - red) ** 2 + (value - green) ** 2 + (value - blue) ** 2
    found: int = _FIRST_GREY + grey if grey_off < off else _FIRST_OF_CUBE + place
    return found


@njit(cache=True, nogil=True)
def _write_colour(
    kind: int, colour: int, is_true_colour: bool, text: NDArray[np.uint8], n: int
) -> int:
    """38 for the upper half, 48 for the lower."""
    n = write_number(kind, text, _write_escape(text, n))
    if is_true_colour:
        n = write_number(2, text, _write_semicolon(text, n))
        for shift in (8, 4, 0):
            n = write_number((colour >> shift & 15) * 17, text, _write_semicolon(text, n))
    else:
        n = write_number(5, text, _write_semicolon(text, n))
        n = write_number(colour, text, _write_semicolon(text, n))
    text[n] = _M
    return n + 1


@njit(cache=True, nogil=True)
def _write_escape(text: NDArray[np.uint8], n: int) -> int:
    text[n], text[n + 1] = _ESCAPE, _BRACKET
    return n + 2


@njit(cache=True, nogil=True)
def _write_semicolon(text: NDArray[np.uint8], n: int) -> int:
    text[n] = _SEMICOLON
    return n + 1
