"""Catmull-Rom resampling of a picture, from the equation with loops."""

import math

import numpy as np


def cubic_weight(distance):
    """Weight of a pixel at a distance, a = -0.5."""
    x = abs(distance)
    if x < 1.0:
        return 1.5 * x**3 - 2.5 * x**2 + 1.0
    return -0.5 * x**3 + 2.5 * x**2 - 4.0 * x + 2.0 if x < 2.0 else 0.0


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
            for y in range(j - 1, j + 3)
            for x in range(i - 1, i + 3)
        )
        values[place] = int(min(max(math.floor(value + 0.5), 0), 255))
    return values
