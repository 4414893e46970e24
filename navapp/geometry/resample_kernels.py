"""Compiled resampling of a picture at given places."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def weights_at(t: np.float32) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Catmull-Rom weights (a = -0.5) of the four pixels around a place; t from the second, 0 to 1.

    A ramp comes out as a ramp: no error follows the fraction of a pixel.
    """
    half = np.float32(0.5)
    t2 = t * t
    t3 = t2 * t
    return (
        t2 - half * (t3 + t),
        np.float32(1.5) * t3 - np.float32(2.5) * t2 + np.float32(1.0),
        np.float32(2.0) * t2 - np.float32(1.5) * t3 + half * t,
        half * (t3 - t2),
    )


@njit(cache=True, nogil=True)
def value_at(picture: NDArray[np.uint8], u: np.float32, v: np.float32) -> np.uint8:
    """Grey value at a place inside the picture; beyond its edge the edge goes on."""
    height, width = picture.shape
    i, j = int(u), int(v)
    across = weights_at(u - np.float32(i))
    down = weights_at(v - np.float32(j))
    value = np.float32(0.5)
    for k in range(4):
        line = picture[min(max(j - 1 + k, 0), height - 1)]
        for m in range(4):
            value += down[k] * across[m] * line[min(max(i - 1 + m, 0), width - 1)]
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
    one, zero = np.float32(1.0), np.float32(0.0)
    for y in range(band[0], band[1]):
        for x in range(span[0], span[1]):
            u, v = columns[y, x], rows[y, x]
            # Also false for NaN.
            if not (u >= zero and u <= last_column and v >= zero and v <= last_row):
                resampled[y, x] = 0
                continue
            if not (u >= one and u < last_column - one and v >= one and v < last_row - one):
                resampled[y, x] = value_at(picture, u, v)
                continue
            i, j = int(u), int(v)
            a0, a1, a2, a3 = weights_at(u - np.float32(i))
            down = weights_at(v - np.float32(j))
            value = np.float32(0.5)
            for k in range(4):
                line = picture[j - 1 + k]
                value += down[k] * (
                    a0 * line[i - 1] + a1 * line[i] + a2 * line[i + 1] + a3 * line[i + 2]
                )
            resampled[y, x] = np.uint8(min(max(value, zero), np.float32(255.0)))
