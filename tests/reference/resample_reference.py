"""Cubic resampling of a picture, from the equation with loops."""

import math

import numpy as np


def cubic_weight(distance):
    """Weight of a pixel at a distance: Keys 1981, order four."""
    x = abs(distance)
    if x < 1.0:
        return (4.0 * x**3 - 7.0 * x**2 + 3.0) / 3.0
    if x < 2.0:
        return (-7.0 * x**3 + 36.0 * x**2 - 59.0 * x + 30.0) / 12.0
    return (x**3 - 8.0 * x**2 + 21.0 * x - 18.0) / 12.0 if x < 3.0 else 0.0


def resample_slowly(picture, columns, rows):
    """(h, w) grey values, rounded; 0 outside the picture, whose edge goes on beyond it."""
    height, width = picture.shape
    values = np.zeros(columns.shape, dtype=int)
    for place in np.ndindex(columns.shape):
        u, v = float(columns[place]), float(rows[place])
        if not (0.0 <= u <= width - 1 and 0.0 <= v <= height - 1):
            continue
        i, j = math.floor(u), math.floor(v)
        value = sum(
            cubic_weight(u - x)
            * cubic_weight(v - y)
            * float(picture[min(max(y, 0), height - 1), min(max(x, 0), width - 1)])
            for y in range(j - 2, j + 4)
            for x in range(i - 2, i + 4)
        )
        values[place] = int(min(max(math.floor(value + 0.5), 0), 255))
    return values
