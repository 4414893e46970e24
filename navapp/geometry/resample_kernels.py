"""Compiled resampling of a picture at given places."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.float_lane_kernels import LANES, load_grey, spread, store

Taps = tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]

# Pixels before the place, and after it.
_BEFORE, _AFTER = 2, 3
N_TAPS = 6
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
def weigh_row(places: NDArray[np.float32], weights: NDArray[np.float32]) -> None:
    """Weights (6, n) in place, of the pixels around places (n,); see `weights_at`."""
    w0, w1, w2, w3, w4, w5 = weights[0], weights[1], weights[2], weights[3], weights[4], weights[5]
    for x in range(places.shape[0]):
        t = places[x] - np.floor(places[x])
        w0[x], w1[x], w2[x], w3[x], w4[x], w5[x] = weights_at(t)


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
    first, after = span
    across = np.empty((N_TAPS, after - first), dtype=np.float32)
    down = np.empty_like(across)
    for y in range(band[0], band[1]):
        weigh_row(columns[y, first:after], across)
        weigh_row(rows[y, first:after], down)
        for x in range(first, after):
            u, v, k = columns[y, x], rows[y, x], x - first
            # Also false for NaN.
            if not (u >= zero and u <= last_column and v >= zero and v <= last_row):
                resampled[y, x] = 0
                continue
            if not (u >= before and u < far_column and v >= before and v < far_row):
                resampled[y, x] = value_at(picture, u, v)
                continue
            at = (int(v) - _BEFORE) * width + int(u) - _BEFORE
            # Eight columns at once, of which the last two do not count.
            above = spread(down[0, k]) * load_grey(grey, at)
            above = above + spread(down[1, k]) * load_grey(grey, at + width)
            at += 2 * width
            middle = spread(down[2, k]) * load_grey(grey, at)
            middle = middle + spread(down[3, k]) * load_grey(grey, at + width)
            at += 2 * width
            below = spread(down[4, k]) * load_grey(grey, at)
            below = below + spread(down[5, k]) * load_grey(grey, at + width)
            store(sums, 0, above + middle + below)
            value = np.float32(0.5) + (across[0, k] * sums[0] + across[1, k] * sums[1])
            value += across[2, k] * sums[2] + across[3, k] * sums[3]
            value += across[4, k] * sums[4] + across[5, k] * sums[5]
            resampled[y, x] = np.uint8(min(max(value, zero), np.float32(255.0)))
