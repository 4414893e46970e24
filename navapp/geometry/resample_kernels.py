"""Compiled resampling of a picture at given places."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.float_lane_kernels import LANES, load_grey, spread, store

Taps = tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]

# Pixels before the place, and after it.
_BEFORE, _AFTER = 2, 3
_TWELFTH = np.float32(1.0 / 12.0)


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
def value_at(picture: NDArray[np.uint8], u: np.float32, v: np.float32) -> np.uint8:
    """Grey value at a place inside the picture; beyond its edge the edge goes on."""
    height, width = picture.shape
    i, j = int(u), int(v)
    across = weights_at(u - np.float32(i))
    down = weights_at(v - np.float32(j))
    value = np.float32(0.5)
    for k in range(6):
        line = picture[min(max(j - _BEFORE + k, 0), height - 1)]
        for m in range(6):
            value += down[k] * across[m] * line[min(max(i - _BEFORE + m, 0), width - 1)]
    return np.uint8(min(max(value, np.float32(0.0)), np.float32(255.0)))


@njit(cache=True, nogil=True)
def resample_rows(
    picture: NDArray[np.uint8],
    columns: NDArray[np.float32],
    rows: NDArray[np.float32],
    band: tuple[int, int],
    span: tuple[int, int],
    resampled: NDArray[np.uint8],
) -> None:
    """Values of a picture at real places, in a part of the rows and columns; 0 outside the picture.

    Args:
        picture: (H, W)
        columns: (h, w) where to look, px.
        rows: (h, w) where to look, px.
        band: first row to fill, and after the last.
        span: first column to fill, and after the last.
        resampled: (h, w) in place.
    """
    height, width = picture.shape
    last_column, last_row = np.float32(width - 1), np.float32(height - 1)
    zero, before = np.float32(0.0), np.float32(_BEFORE)
    far_column, far_row = np.float32(width - (LANES - 1 - _BEFORE)), np.float32(height - _AFTER)
    grey, sums = picture.ravel(), np.empty(LANES, dtype=np.float32)
    for y in range(band[0], band[1]):
        for x in range(span[0], span[1]):
            u, v = columns[y, x], rows[y, x]
            # Also false for NaN.
            if not (u >= zero and u <= last_column and v >= zero and v <= last_row):
                resampled[y, x] = 0
                continue
            if not (u >= before and u < far_column and v >= before and v < far_row):
                resampled[y, x] = value_at(picture, u, v)
                continue
            i, j = int(u), int(v)
            d0, d1, d2, d3, d4, d5 = weights_at(v - np.float32(j))
            at = (j - _BEFORE) * width + i - _BEFORE
            # Eight columns at once, of which the last two do not count.
            above = spread(d0) * load_grey(grey, at) + spread(d1) * load_grey(grey, at + width)
            at += 2 * width
            middle = spread(d2) * load_grey(grey, at) + spread(d3) * load_grey(grey, at + width)
            at += 2 * width
            below = spread(d4) * load_grey(grey, at) + spread(d5) * load_grey(grey, at + width)
            store(sums, 0, above + middle + below)
            a0, a1, a2, a3, a4, a5 = weights_at(u - np.float32(i))
            value = np.float32(0.5) + (a0 * sums[0] + a1 * sums[1]) + (a2 * sums[2] + a3 * sums[3])
            value += a4 * sums[4] + a5 * sums[5]
            resampled[y, x] = np.uint8(min(max(value, zero), np.float32(255.0)))
