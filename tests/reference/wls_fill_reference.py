"""Occlusion filling pixel by pixel: the same rules with lists and a least squares solver."""

import math

import numpy as np
from numpy.typing import NDArray

from navapp.values import Origin


def filled_slowly(disparity, support, picture, confidence, classes, settings, radius):
    """Value, lowest and highest permitted value, (3, h, w); NaN where nothing may speak."""
    told = np.full((3, *disparity.shape), np.nan)
    for y, x in zip(*np.nonzero(classes), strict=True):
        sides = _permitted(support[y], x, classes[y, x], settings.max_gap_px)
        if sides:
            layer = min(disparity[y, u] for u in sides)
            told[:, y, x] = _fit(
                disparity, support, picture, confidence, settings, radius, (y, x), sides, layer
            )
    return told


def _permitted(support: NDArray, x: int, label: int, max_gap: int | None) -> list[int]:
    """Columns of the nearest support on the sides that may speak."""
    columns = np.flatnonzero(support)
    found = []
    if label != Origin.FILLED_BORDER and (columns < x).any():
        found.append(columns[columns < x].max())
    if label != Origin.FILLED_INTERIOR and (columns > x).any():
        found.append(columns[columns > x].min())
    return [int(u) for u in found if max_gap is None or abs(u - x) <= max_gap]


def _fit(disparity, support, picture, confidence, settings, radius, place, sides, layer):
    y, x = place
    height, width = disparity.shape
    rows, stride = round(0.3 * radius), max(2, round(radius / 13))
    begin = min([x] + [u - radius for u in sides if u < x])
    end = max([x] + [u + radius for u in sides if u > x])
    equations = []
    for v in range(y - rows, y + rows + 1, stride):
        for u in range(max(begin, 0), min(end, width - 1) + 1, stride):
            if not 0 <= v < height or not support[v, u]:
                continue
            dx, dy, d = u - x, v - y, float(disparity[v, u])
            if abs(d - layer) >= settings.layer_px + settings.layer_growth * abs(dx):
                continue
            colour = np.abs(picture[v, u].astype(float) - picture[y, x]).sum()
            weight = (0.05 + confidence[v, u]) * math.exp(
                -colour / settings.colour_scale - math.hypot(dx, dy) / (0.4 * radius)
            )
            equations.append((weight, dx, dy, d))
    if not equations:
        return math.nan, math.nan, math.nan
    weight, dx, dy, d = np.array(equations).T
    # The slopes' penalty as two more equations: a measured zero of either slope.
    pull = weight.sum() * settings.slope_penalty_px2
    root = np.sqrt(np.append(weight, [pull, pull]))
    design = np.column_stack([np.ones_like(dx), dx, dy])
    design = np.vstack([design, [[0, 1, 0], [0, 0, 1]]])
    target = np.append(d, [0.0, 0.0])
    value = np.linalg.lstsq(root[:, None] * design, root * target, rcond=None)[0][0]
    low, high = d.min() - 1.0, d.max() + 1.0
    return min(max(value, low), high), low, high


def calmed_slowly(disparity, told, classes):
    """Upper median of the known 5 x 5 neighbours, within the permitted values."""
    calmed = disparity.copy()
    for y, x in zip(*np.nonzero(classes), strict=True):
        if math.isnan(disparity[y, x]):
            continue
        around = disparity[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3].ravel()
        known = np.sort(around[np.isfinite(around)])
        calmed[y, x] = np.clip(known[len(known) // 2], told[1, y, x], told[2, y, x])
    return calmed
