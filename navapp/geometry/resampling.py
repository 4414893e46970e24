"""Looks up a picture at real places: where they are, and the values there."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.box import Box
from navapp.geometry.transform import FloatArray

if TYPE_CHECKING:
    # Kernels are loaded at first use: the command line starts without a compiler.
    from navapp.geometry.resample_kernels import Places

# Pixels on either side that interpolation and sub-pixel steps ask for.
TAPS_PX = 8


def find_places(columns: NDArray[np.float32], rows: NDArray[np.float32]) -> "Places":
    """Where to look for pixels (h, w), from smooth maps of both coordinates; columns grow in them.

    The other picture has the same size.
    """
    from navapp.geometry.resample_kernels import Places

    height, width = columns.shape
    at = np.arange(width)
    reached = np.maximum.accumulate(_extend(columns), axis=1)
    crossings = np.empty((height, width), dtype=np.float32)
    for y, found in enumerate(_extend(rows)):
        crossings[y] = np.interp(at, reached[y], found)
    is_inside = (rows >= 0.0).all(axis=1) & (rows <= height - 1.0).all(axis=1)
    in_step = _are_in_step(np.floor(columns) - at.astype(np.float32))
    in_row = _are_in_row(np.floor(crossings))
    return Places(np.ascontiguousarray(columns), crossings, in_step, in_row, is_inside)


def shift_places(places: "Places", row_shift_px: FloatArray, part: Box) -> "Places":
    """The places of a part's rows, moved by (h, 2) x and y in the picture; other rows stay empty.

    The curve along which a row is looked for is taken as straight over the shift.
    """
    from navapp.geometry.resample_kernels import Places

    band = part.clip(places.columns.shape[1], len(places.columns)).slices[0]
    at = np.arange(places.columns.shape[1], dtype=np.float32)
    x, y = np.float32(row_shift_px[band, 0:1]), np.float32(row_shift_px[band, 1:2])
    curves = places.rows[band]
    slope = (curves[:, -1:] - curves[:, :1]) / np.float32(max(curves.shape[1] - 1, 1))
    columns, rows = np.empty_like(places.columns), np.empty_like(places.rows)
    columns[band], rows[band] = places.columns[band] + x, curves + (y - slope * x)
    in_step, in_row = np.zeros_like(places.in_step), np.zeros_like(places.in_row)
    in_step[band] = _are_in_step(np.floor(columns[band]) - at)
    in_row[band] = _are_in_row(np.floor(rows[band]))
    # Not known any more: every pixel is asked.
    is_inside = np.zeros_like(places.is_inside)
    return Places(columns, rows, in_step, in_row, is_inside)


def _are_in_step(steps: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(h, blocks) of whole columns less their own place (h, w): but for one jump at most."""
    blocks = _lane_blocks(steps)
    is_in_step: NDArray[np.bool_] = (
        (blocks == blocks[..., :1]) | (blocks == blocks[..., -1:])
    ).all(axis=2)
    return is_in_step


def _are_in_row(lines: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(h, blocks) of whole rows (h, w): all the same."""
    blocks = _lane_blocks(lines)
    is_in_row: NDArray[np.bool_] = (blocks == blocks[..., :1]).all(axis=2)
    return is_in_row


def _extend(lines: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, w + 2) of (h, w): straight on at either end, by so many pixels as interpolation asks."""
    before = lines[:, 0] + TAPS_PX * (lines[:, 0] - lines[:, 1])
    after = lines[:, -1] + TAPS_PX * (lines[:, -1] - lines[:, -2])
    return np.column_stack([before, lines, after])


def _lane_blocks(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, blocks, FLOAT_LANES) of (h, w); a cut block is filled up with NaN."""
    from navapp.geometry.lane_kernels import FLOAT_LANES, lanes_for

    height, width = values.shape
    full = np.full((height, lanes_for(width, FLOAT_LANES)), np.nan, dtype=np.float32)
    full[:, :width] = values
    return full.reshape(height, -1, FLOAT_LANES)


def resample(
    picture: NDArray[np.uint8], places: "Places", part: Box | None = None
) -> NDArray[np.uint8]:
    """The picture at real places (h, w), cubic over six pixels; 0 outside it, and outside a part.

    Linear interpolation, and less so a cubic over four pixels, blurs by where a pixel falls;
    OpenCV's cubic (a = -0.75) bends a ramp: all tilt a disparity that is measured to a part of a
    pixel.
    """
    from navapp.geometry.resample_kernels import resample_rows

    if picture.ndim == 3:
        return np.dstack([resample(picture[..., k], places, part) for k in range(3)])
    picture = np.ascontiguousarray(picture)
    values = np.zeros(places.columns.shape, dtype=np.uint8)
    height, width = places.columns.shape
    inside = Box(0, 0, width, height) if part is None else part.clip(width, height)
    if inside.is_empty:
        return values
    span = (inside.x, inside.x + inside.width)
    rows_of = partial(resample_rows, picture, places, span=span, resampled=values)
    in_row_bands(inside.height, rows_of, first=inside.y)
    return values
