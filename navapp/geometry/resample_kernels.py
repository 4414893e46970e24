"""Compiled resampling of a picture: first along its columns, then along the rows that come out."""

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.lane_kernels import (
    FLOAT_LANES,
    all_positive,
    larger,
    load,
    load_grey,
    smaller,
    spread,
    store,
    store_grey,
    where_positive,
    whole,
)

Taps = tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]

# Pixels before the place, and after it.
_BEFORE, _AFTER = 2, 3
N_TAPS = 6
_TWELFTH = np.float32(1.0 / 12.0)


class Places(NamedTuple):
    """Where to look for the pixels of a picture (h, w) in another one (H, W)."""

    columns: NDArray[np.float32]  # (h, w) px
    # (h, W) px: where the curve along which a row is looked for crosses the other's columns.
    rows: NDArray[np.float32]
    # (h, blocks of w) whether the pixels of a block of `FLOAT_LANES` lie one column apart, but for
    # one jump at most.
    in_step: NDArray[np.bool_]
    # (h, blocks of W) whether a block of `rows` lies between the same two rows.
    in_row: NDArray[np.bool_]
    is_inside: NDArray[np.bool_]  # (h,) whether the whole curve lies in the other picture


@njit(cache=True, nogil=True)
def weights_at(t: np.float32) -> Taps:
    """Weights of the six pixels around a place; t from the third, 0 to 1.

    A cubic comes out as it is, so detail of a few pixels hardly fades with the fraction of a pixel.

    Source: Keys 1981, cubic convolution interpolation, the kernel of order four.
    """
    t2 = t * t
    t3 = t2 * t
    two, seven, eight = np.float32(2.0), np.float32(7.0), np.float32(8.0)
    return (
        _TWELFTH * (t3 - two * t2 + t),
        _TWELFTH * (np.float32(15.0) * t2 - seven * t3 - eight * t),
        _TWELFTH * (np.float32(16.0) * t3 - np.float32(28.0) * t2) + np.float32(1.0),
        _TWELFTH * (np.float32(20.0) * t2 - np.float32(16.0) * t3 + eight * t),
        _TWELFTH * (seven * t3 - np.float32(6.0) * t2 - t),
        _TWELFTH * (t2 - t3),
    )


@njit(cache=True, nogil=True)
def lanes_at(t: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
    """As `weights_at`, for lanes."""
    t2 = t * t
    t3 = t2 * t
    part, one = spread(_TWELFTH), spread(np.float32(1.0))
    two, six, seven = spread(np.float32(2.0)), spread(np.float32(6.0)), spread(np.float32(7.0))
    eight, fifteen = spread(np.float32(8.0)), spread(np.float32(15.0))
    sixteen, twenty = spread(np.float32(16.0)), spread(np.float32(20.0))
    return (
        part * (t3 - two * t2 + t),
        part * (fifteen * t2 - seven * t3 - eight * t),
        part * (sixteen * t3 - spread(np.float32(28.0)) * t2) + one,
        part * (twenty * t2 - sixteen * t3 + eight * t),
        part * (seven * t3 - six * t2 - t),
        part * (t2 - t3),
    )


@njit(cache=True, nogil=True)
def value_across(crossed: NDArray[np.float32], place: np.float32) -> np.float32:
    """Value at a place of a row; its column 0 lies at `_BEFORE`."""
    column = int(place)
    taps = weights_at(place - np.float32(column))
    total: np.float32 = taps[0] * crossed[column]
    for k in range(1, N_TAPS):
        total += taps[k] * crossed[column + k]
    return total


@njit(cache=True, nogil=True)
def value_down(picture: NDArray[np.uint8], place: np.float32, x: int) -> np.float32:
    """Value at a place of a picture's column; beyond its edge the edge goes on."""
    last, row = picture.shape[0] - 1, int(np.floor(place))
    taps = weights_at(place - np.float32(row))
    total: np.float32 = taps[0] * np.float32(picture[min(max(row - _BEFORE, 0), last), x])
    for k in range(1, N_TAPS):
        total += taps[k] * np.float32(picture[min(max(row - _BEFORE + k, 0), last), x])
    return total


@njit(cache=True, nogil=True)
def block_down(grey: NDArray[np.uint8], width: int, place: Any, row: int, first: int) -> Any:
    """Values of `FLOAT_LANES` columns of a flat picture from `first` on, just below a row."""
    w0, w1, w2, w3, w4, w5 = lanes_at(place - whole(place))
    at = (row - _BEFORE) * width + first
    value = w0 * load_grey(grey, at) + w1 * load_grey(grey, at + width)
    at += 2 * width
    value = value + w2 * load_grey(grey, at) + w3 * load_grey(grey, at + width)
    at += 2 * width
    return value + w4 * load_grey(grey, at) + w5 * load_grey(grey, at + width)


@njit(cache=True, nogil=True)
def is_in_two_rows(rows: NDArray[np.float32], first: int, height: int) -> bool:
    """Whether `FLOAT_LANES` places lie between three rows of a picture, with room around them."""
    low = np.floor(min(rows[first], rows[first + FLOAT_LANES - 1]))
    if not (low >= np.float32(_BEFORE) and low + np.float32(_AFTER + 1) < np.float32(height)):
        return False
    one, lower = spread(np.float32(1.0)), whole(load(rows, first)) - spread(np.float32(low))
    # Nothing but 0 and 1 will do.
    wrong = lower * (lower - one)
    return bool(all_positive(one - wrong * wrong))


@njit(cache=True, nogil=True)
def cross_row(
    picture: NDArray[np.uint8],
    rows: NDArray[np.float32],
    in_row: NDArray[np.bool_],
    span: tuple[int, int],
    crossed: NDArray[np.float32],
) -> None:
    """Values of a picture where a curve crosses its columns.

    Args:
        picture: (H, W).
        rows: (W,) of the curve, px.
        in_row: (blocks,) as in `Places`.
        span: first column to fill, a multiple of the lanes, and after the last.
        crossed: (W + 13,) in place; column 0 lies at `_BEFORE`.
    """
    height, width = picture.shape
    grey = picture.ravel()
    for first in range(span[0], span[1], FLOAT_LANES):
        row = int(np.floor(rows[first]))
        # A cut block is never in a row.
        if in_row[first // FLOAT_LANES] and row >= _BEFORE and row + _AFTER < height:
            store(crossed, _BEFORE + first, block_down(grey, width, load(rows, first), row, first))
        elif first + FLOAT_LANES <= width and is_in_two_rows(rows, first, height):
            row, place = int(min(rows[first], rows[first + FLOAT_LANES - 1])), load(rows, first)
            upper = block_down(grey, width, place, row, first)
            lower = block_down(grey, width, place, row + 1, first)
            is_lower = whole(place) - spread(np.float32(row))
            store(crossed, _BEFORE + first, where_positive(is_lower, lower, upper))
        else:
            for x in range(first, min(first + FLOAT_LANES, width)):
                crossed[_BEFORE + x] = value_down(picture, rows[x], x)


@njit(cache=True, nogil=True)
def resample_block(
    crossed: NDArray[np.float32], columns: NDArray[np.float32], first: int,
    greys: NDArray[np.uint8], at: int, room: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Grey values of `FLOAT_LANES` places of a row that lie one column apart, but for one jump.

    Args:
        crossed: of the row; all that is asked for lies in it.
        columns: (w,) places.
        first: of the places.
        greys: in place, from `at` on.
        at: see above.
        room: (lanes,) to work in.
    """
    place = load(columns, first)
    w0, w1, w2, w3, w4, w5 = lanes_at(place - whole(place))
    zero, most, half = spread(np.float32(0.0)), spread(np.float32(255.0)), spread(np.float32(0.5))
    begin, end = int(columns[first]), int(columns[first + FLOAT_LANES - 1]) - (FLOAT_LANES - 1)
    value = w0 * load(crossed, begin) + w1 * load(crossed, begin + 1)
    value = value + w2 * load(crossed, begin + 2) + w3 * load(crossed, begin + 3)
    value = value + w4 * load(crossed, begin + 4) + w5 * load(crossed, begin + 5)
    store_grey(greys, at, smaller(larger(value + half, zero), most))
    if begin == end:
        return
    value = w0 * load(crossed, end) + w1 * load(crossed, end + 1)
    value = value + w2 * load(crossed, end + 2) + w3 * load(crossed, end + 3)
    value = value + w4 * load(crossed, end + 4) + w5 * load(crossed, end + 5)
    store_grey(room, 0, smaller(larger(value + half, zero), most))
    for k in range(FLOAT_LANES):
        if int(columns[first + k]) - k != begin:
            greys[at + k] = room[k]


@njit(cache=True, nogil=True)
def resample_rows(
    picture: NDArray[np.uint8],
    places: Places,
    band: tuple[int, int],
    span: tuple[int, int],
    resampled: NDArray[np.uint8],
) -> None:
    """Values of a picture at real places, in a part of the rows and columns; 0 outside the picture.

    Args:
        picture: (H, W)
        places: where to look.
        band: first row to fill, and after the last.
        span: first column to fill, and after the last.
        resampled: (h, w) in place.
    """
    height, width = picture.shape
    zero, most, half = np.float32(0.0), np.float32(255.0), np.float32(0.5)
    last_column, last_row = np.float32(width - 1), np.float32(height - 1)
    far_column = np.float32(width - FLOAT_LANES)
    crossed = np.zeros(width + 2 * N_TAPS + 1, dtype=np.float32)
    greys, n_columns, room = resampled.ravel(), resampled.shape[1], np.empty(FLOAT_LANES, np.uint8)
    for y in range(band[0], band[1]):
        columns, rows, out = places.columns[y], places.rows[y], resampled[y]
        in_step = places.in_step[y]
        # Columns only grow along a row.
        low = min(max(int(columns[span[0]]) - _BEFORE, 0), width - 1) // FLOAT_LANES * FLOAT_LANES
        high = min(max(int(columns[span[1] - 1]) + _AFTER + 1, low + 1), width)
        cross_row(picture, rows, places.in_row[y], (low, high), crossed)
        crossed[:_BEFORE], crossed[_BEFORE + width :] = crossed[_BEFORE], crossed[width + 1]
        for block in range(span[0] // FLOAT_LANES * FLOAT_LANES, span[1], FLOAT_LANES):
            first, after = max(block, span[0]), min(block + FLOAT_LANES, span[1])
            begin, end = columns[first], columns[after - 1]
            is_full = after == block + FLOAT_LANES and first == block
            if is_full and in_step[block // FLOAT_LANES] and begin >= zero and end < far_column:
                resample_block(crossed, columns, block, greys, y * n_columns + block, room)
            else:
                for x in range(first, after):
                    if columns[x] >= zero and columns[x] <= last_column:
                        value = value_across(crossed, columns[x])
                        out[x] = np.uint8(min(max(value + half, zero), most))
                    else:
                        out[x] = 0
        if not places.is_inside[y]:
            for x in range(span[0], span[1]):
                column = min(max(int(columns[x] + half), 0), width - 1)
                if not (rows[column] >= zero and rows[column] <= last_row):
                    out[x] = 0
