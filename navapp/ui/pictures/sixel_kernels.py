"""Turns a picture into sixels (DEC STD 070): six rows of one colour in each character."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.ui.pictures.number_kernels import write_number

# 6 x 6 x 6 colours; the registers of a VT340 are fewer, those of its emulators are more.
N_LEVELS = 6
N_COLOURS = N_LEVELS**3
_STEP = 255 // (N_LEVELS - 1)
_BAND = 6
_RUN, _EMPTY, _COLOUR, _RETURN, _NEXT_BAND = (ord(one) for one in "!?#$-")
# Bayer's ordered dither 4 x 4: a sixteenth of a step each.
_DITHER = (
    np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) * _STEP // 16
).astype(np.uint8)


def count_most_bytes(height: int, width: int) -> int:
    """More than any picture of that size takes."""
    # A pixel is at worst a run of empty columns and a character; a band names each colour.
    n_bands = -(-height // _BAND)
    return n_bands * (_BAND * width * 8 + N_COLOURS * 6)


@njit(cache=True, nogil=True)
def find_colours(picture: NDArray[np.uint8], indexes: NDArray[np.uint8]) -> None:
    """Dither (h, w, 3) BGR to the colour cube; the numbers of its colours into (h, w) `indexes`."""
    for y in range(picture.shape[0]):
        for x in range(picture.shape[1]):
            more = _DITHER[y & 3, x & 3]
            blue = (picture[y, x, 0] + more) // _STEP
            green = (picture[y, x, 1] + more) // _STEP
            red = (picture[y, x, 2] + more) // _STEP
            indexes[y, x] = (red * N_LEVELS + green) * N_LEVELS + blue


@njit(cache=True, nogil=True)
def encode_sixels(
    indexes: NDArray[np.uint8],
    columns: NDArray[np.int16],
    sixels: NDArray[np.uint8],
    text: NDArray[np.uint8],
) -> int:
    """Write the sixels of a picture as text, without introducer and colours; its length.

    Args:
        indexes: (h, w) numbers of colours.
        columns: (N_COLOURS, w) room for the columns of a band in which a colour is.
        sixels: (N_COLOURS, w) room for their six rows, a bit each.
        text: room for `count_most_bytes`.
    """
    height, width = indexes.shape
    counts = np.zeros(N_COLOURS, np.int64)
    present = np.zeros(N_COLOURS, np.int64)
    n = 0
    for top in range(0, height, _BAND):
        n_present = 0
        for x in range(width):
            for row in range(min(_BAND, height - top)):
                colour = indexes[top + row, x]
                count = counts[colour]
                if count and columns[colour, count - 1] == x:
                    sixels[colour, count - 1] |= 1 << row
                    continue
                if count == 0:
                    present[n_present] = colour
                    n_present += 1
                columns[colour, count] = x
                sixels[colour, count] = 1 << row
                counts[colour] = count + 1
        for k in range(n_present):
            colour = present[k]
            n = _write_colour(colour, columns[colour, : counts[colour]], sixels[colour], text, n)
            counts[colour] = 0
            text[n] = _RETURN
            n += 1
        # Over the last return: the next band begins at the left as well.
        text[n - 1] = _NEXT_BAND
    return n


@njit(cache=True, nogil=True)
def _write_colour(
    colour: int,
    columns: NDArray[np.int16],
    sixels: NDArray[np.uint8],
    text: NDArray[np.uint8],
    n: int,
) -> int:
    """One colour's sixels of one band, what lies between them empty."""
    text[n] = _COLOUR
    n = write_number(colour, text, n + 1)
    written = 0
    k = 0
    while k < len(columns):
        same = k + 1
        while (
            same < len(columns)
            and columns[same] == columns[same - 1] + 1
            and sixels[same] == sixels[k]
        ):
            same += 1
        n = _write_run(_EMPTY, columns[k] - written, text, n)
        n = _write_run(_EMPTY + sixels[k], same - k, text, n)
        written = columns[k] + same - k
        k = same
    return n


@njit(cache=True, nogil=True)
def _write_run(character: int, count: int, text: NDArray[np.uint8], n: int) -> int:
    if count > 3:
        text[n] = _RUN
        n = write_number(count, text, n + 1)
        count = 1
    for _ in range(count):
        text[n] = character
        n += 1
    return n
