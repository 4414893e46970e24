"""Occlusion filling piece by piece: the same rules with lists and a least squares solver."""

import math

import numpy as np
from numpy.typing import NDArray

from navapp.values import Origin


class SlowFill:
    """One map to fill; `disparity` is matched where `support` says so."""

    def __init__(self, disparity, support, picture, confidence, classes, settings, radius):
        self.disparity, self.support, self.classes = disparity, support, classes
        self.picture, self.confidence = picture.astype(float), confidence
        self.settings, self.radius = settings, radius

    def told(self) -> NDArray:
        """(h, w) the disparity, and what is told where it is classified; NaN: no match fills it."""
        told = np.where(self.classes == 0, self.disparity, np.nan)
        for y, row in enumerate(told):
            neighbours = self._neighbours(y)
            begin = 0
            for x, own in enumerate(neighbours):
                if self._goes_on(y, begin, x + 1) and neighbours[x + 1] == own:
                    continue
                if own:
                    row[begin : x + 1] = self._fill_piece(y, np.arange(begin, x + 1), own)
                begin = x + 1
        return told

    def _goes_on(self, y: int, begin: int, x: int) -> bool:
        """Whether a piece may reach column x."""
        row = self.picture[y]
        return x < len(row) and x - begin < 16 and abs(row[x] - row[begin]) <= 30

    def _neighbours(self, y: int) -> list[list[int]]:
        """Columns of the nearest matches from which each pixel of a row may be filled."""
        columns, max_gap = np.flatnonzero(self.support[y]), self.settings.max_gap_px
        found = []
        for x, label in enumerate(self.classes[y]):
            own = []
            if label in (Origin.FILLED_INTERIOR, Origin.MISMATCH_FILLED):
                own += list(columns[columns < x][-1:])
            if label in (Origin.FILLED_BORDER, Origin.MISMATCH_FILLED):
                own += list(columns[columns > x][:1])
            found.append([int(u) for u in own if max_gap is None or abs(u - x) <= max_gap])
        return found

    def _fill_piece(self, y: int, columns: NDArray, neighbours: list[int]) -> NDArray:
        middle, grey = columns.mean(), self.picture[y, columns].mean()
        layer, distance = min((self.disparity[y, u], abs(u - middle)) for u in neighbours)
        equations = []
        for v, u in self._find_support(y, middle, neighbours):
            dx, dy, d = u - middle, v - y, float(self.disparity[v, u] - layer)
            if abs(d) < self.settings.layer_px + self.settings.layer_growth * abs(dx):
                exponent = (math.hypot(dx, dy) - distance) / (0.4 * self.radius)
                exponent += abs(self.picture[v, u] - grey) / self.settings.grey_scale
                weight = (0.05 + np.nan_to_num(self.confidence[v, u])) * math.exp(-exponent)
                equations.append((weight, dx, dy, d))
        value, slope = plane_at_origin(np.array(equations), self.settings.slope_penalty_px2)
        d = np.array(equations)[:, 3]
        return layer + np.clip(value + slope * (columns - middle), d.min() - 1.0, d.max() + 1.0)

    def _find_support(self, y: int, middle: float, neighbours: list[int]) -> list[tuple[int, int]]:
        """Rows and columns of every third match around the neighbours, inwards up to the middle."""
        height, width = self.support.shape
        up = max(round(0.3 * self.radius) // 3, 1) * 3
        found = []
        for first in neighbours:
            outwards = 1 if first > middle else -1
            inwards = min(int(abs(first - middle) - 0.5), self.radius) // 3 * 3
            for v in range(y - up, y + up + 1, 3):
                for k in range(-inwards, self.radius + 1, 3):
                    u = first + outwards * k
                    if 0 <= v < height and 0 <= u < width and self.support[v, u]:
                        found.append((v, u))
        return found


def plane_at_origin(equations: NDArray, slope_penalty: float) -> tuple[float, float]:
    """Value and slope along x of the weighted plane at the origin."""
    weight, dx, dy, d = equations.T
    # The slopes' penalty as two more equations: a measured zero of either slope.
    pull = weight.sum() * slope_penalty
    root = np.sqrt(np.append(weight, [pull, pull]))
    design = np.column_stack([np.ones_like(dx), dx, dy])
    design = np.vstack([design, [[0, 1, 0], [0, 0, 1]]])
    target = np.append(d, [0.0, 0.0])
    value, slope, _ = np.linalg.lstsq(root[:, None] * design, root * target, rcond=None)[0]
    return value, slope
