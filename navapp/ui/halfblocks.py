"""Converts a picture to terminal cells of two pixels each."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from rich.color import Color
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

# Sixteen levels a channel: longer runs, a third of the processor time, hardly seen.
_LEVELS = 15
_UPPER_HALF = "▀"

FloatArray = NDArray[np.float64]


def _mean_over_parts(picture: FloatArray, n_parts: int) -> FloatArray:
    """The first axis cut into equal parts, cutting through pixels, and the mean of each.

    By running sums: no matrix product, because a BLAS keeps its threads awake between pictures.
    """
    n = len(picture)
    sums = np.concatenate([np.zeros_like(picture[:1]), np.cumsum(picture, axis=0)])
    cuts = np.linspace(0.0, n, n_parts + 1)
    whole = np.minimum(cuts.astype(np.intp), n - 1)
    rest = (cuts - whole).reshape(-1, *(1,) * (picture.ndim - 1))
    sums_at_cuts = sums[whole] + rest * picture[whole]
    means: FloatArray = np.diff(sums_at_cuts, axis=0) * (n_parts / n)
    return means


def resize_by_area(picture: NDArray[np.uint8], height: int, width: int) -> FloatArray:
    """(height, width, 3): every output pixel is the mean over its area of (h, w, 3) input."""
    rows = _mean_over_parts(picture.astype(np.float64), height)
    return _mean_over_parts(rows.swapaxes(0, 1), width).swapaxes(0, 1)


def fit_size(shape: tuple[int, ...], columns: int, rows: int) -> tuple[int, int]:
    """Width in columns and height in half rows of the largest picture that fits, height even."""
    h, w = shape[:2]
    scale = min(columns / w, 2 * rows / h)
    width = min(max(round(w * scale), 1), columns)
    height = min(max(2 * round(h * scale / 2), 2), 2 * rows)
    return width, height


def _find_frame(shape: tuple[int, ...], columns: int, rows: int) -> tuple[int, int, int, int]:
    """Top, left, height and width of a picture in half rows and columns."""
    width, height = fit_size(shape, columns, rows)
    return 2 * ((2 * rows - height) // 4), (columns - width) // 2, height, width


def find_place(
    shape: tuple[int, ...], columns: int, rows: int, x: int, y: int
) -> tuple[float, float]:
    """Where the middle of a cell lies in the picture: parts of its width and of its height.

    Args:
        shape: (h, w) of the picture.
        columns: of all cells.
        rows: of all cells.
        x: column of the cell; beside the picture its edge is told.
        y: its row.
    """
    top, left, height, width = _find_frame(shape, columns, rows)
    across, down = (x + 0.5 - left) / width, (2 * y + 1 - top) / height
    return min(max(across, 0.0), 1.0), min(max(down, 0.0), 1.0)


def compute_cell_codes(picture: NDArray[np.uint8], columns: int, rows: int) -> NDArray[np.int32]:
    """Colours of (rows, columns) cells: upper half in bits 12 to 23, lower in bits 0 to 11.

    Args:
        picture: (h, w, 3) BGR; centred on black, its aspect ratio kept, cells taken as 1 : 2.
        columns: of cells, at least 1.
        rows: of cells, at least 1.
    """
    top, left, height, width = _find_frame(picture.shape[:2], columns, rows)
    levels = np.rint(resize_by_area(picture, height, width) * (_LEVELS / 255.0)).astype(np.int32)
    colours = (levels[:, :, 2] << 8) | (levels[:, :, 1] << 4) | levels[:, :, 0]
    canvas = np.zeros((2 * rows, columns), dtype=np.int32)
    canvas[top : top + height, left : left + width] = colours
    return (canvas[0::2] << 12) | canvas[1::2]


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
    brightness = (0.299 * red + 0.587 * green + 0.114 * blue) / _LEVELS
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
