"""Converts a picture to terminal cells of two pixels each."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from rich.color import Color
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from navapp.overlay.fitting import put_on_canvas
from navapp.ui.pictures.block_kernels import LEVELS

_UPPER_HALF = "▀"


def compute_cell_codes(picture: NDArray[np.uint8], columns: int, rows: int) -> NDArray[np.int32]:
    """Colours of (rows, columns) cells: upper half in bits 12 to 23, lower in bits 0 to 11.

    Args:
        picture: (h, w, 3) BGR or (h, w) grey; centred on black, its aspect ratio kept,
            cells taken as 1 : 2.
        columns: of cells, at least 1.
        rows: of cells, at least 1.
    """
    canvas = put_on_canvas(picture, columns, 2 * rows)
    levels = np.rint(canvas * (LEVELS / 255.0)).astype(np.int32)
    codes = (levels[:, :, 2] << 8) | (levels[:, :, 1] << 4) | levels[:, :, 0]
    return np.asarray((codes[0::2] << 12) | codes[1::2], dtype=np.int32)


def _colour(code: int) -> Color:
    return Color.from_rgb((code >> 8 & 15) * 17, (code >> 4 & 15) * 17, (code & 15) * 17)


@lru_cache(maxsize=16384)
def _cell(code: int) -> tuple[str, Style]:
    upper, lower = code >> 12, code & 0xFFF
    if upper == lower:
        return " ", Style(bgcolor=_colour(upper))
    return _UPPER_HALF, Style(color=_colour(upper), bgcolor=_colour(lower))


@lru_cache(maxsize=4096)
def _ramp_cell(code: int, ramp: str) -> tuple[str, Style]:
    """One character for both halves: brightness by its ink, so that it needs no colour at all."""
    halves = (code >> 12, code & 0xFFF)
    red, green, blue = (sum(half >> shift & 15 for half in halves) / 2 for shift in (8, 4, 0))
    brightness = (0.299 * red + 0.587 * green + 0.114 * blue) / LEVELS
    colour = Color.from_rgb(red * 17, green * 17, blue * 17)
    return ramp[round(brightness * (len(ramp) - 1))], Style(color=colour, bgcolor=_colour(0))


def make_row_strip(codes: NDArray[np.int32], ramp: str = "") -> Strip:
    """One row of cells: a segment per run of equal cells."""
    starts = np.flatnonzero(np.diff(codes, prepend=codes[0] - 1))
    lengths = np.diff(starts, append=len(codes))
    segments = []
    for code, length in zip(codes[starts].tolist(), lengths.tolist(), strict=True):
        character, style = _ramp_cell(code, ramp) if ramp else _cell(code)
        segments.append(Segment(character * length, style))
    return Strip(segments, len(codes))
