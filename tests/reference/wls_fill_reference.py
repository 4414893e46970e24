"""Occlusion filling pixel by pixel: the same rules with lists and a least squares solver."""

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
        self.stride = max(2, round(radius / 13))
        self.asked = [
            (v, u)
            for v in range(0, len(support), self.stride)
            for u in asked_columns(support[v], self.stride)
        ]

    def told(self) -> NDArray:
        """(h, w) the disparity, and what is told where it is classified; NaN: nothing may speak."""
        told = np.where(self.classes == 0, self.disparity, np.nan)
        for y in range(0, len(told), 2):
            self._fill_runs(y, told[y], self._speakers(y))
        for y in range(1, len(told), 2):
            speakers = self._speakers(y)
            for x, who in enumerate(speakers):
                if who:
                    told[y, x] = self._from_beside(y, x, told)
                    speakers[x] = [] if np.isfinite(told[y, x]) else who
            self._fill_runs(y, told[y], speakers)
        return told

    def _speakers(self, y: int) -> list[list[int]]:
        """Columns of the nearest support on the sides that may speak, for every pixel of a row."""
        columns, max_gap = np.flatnonzero(self.support[y]), self.settings.max_gap_px
        found = []
        for x, label in enumerate(self.classes[y]):
            who = []
            if label in (Origin.FILLED_INTERIOR, Origin.MISMATCH_FILLED):
                who += list(columns[columns < x][-1:])
            if label in (Origin.FILLED_BORDER, Origin.MISMATCH_FILLED):
                who += list(columns[columns > x][:1])
            found.append([int(u) for u in who if max_gap is None or abs(u - x) <= max_gap])
        return found

    def _fill_runs(self, y: int, row: NDArray, speakers: list[list[int]]) -> None:
        begin = 0
        while begin < len(row):
            end = begin + 1
            while end < len(row) and speakers[end] == speakers[begin]:
                end += 1
            if speakers[begin]:
                fitted = fitted_columns(begin, end - 1, speakers[begin])
                values = [self._fit(y, x, speakers[begin]) for x in fitted]
                row[begin:end] = np.interp(np.arange(begin, end), fitted, values)
            begin = end

    def _from_beside(self, y: int, x: int, told: NDArray) -> float:
        beside = [
            (abs(self.picture[v, x] - self.picture[y, x]), told[v, x])
            for v in (y + 1, y - 1)
            if v < len(told)
            and self.classes[v, x] == self.classes[y, x]
            and told[v, x] == told[v, x]
        ]
        if len(beside) == 2 and abs(beside[0][1] - beside[1][1]) < 1.0:
            return (beside[0][1] + beside[1][1]) / 2.0
        return min(beside, key=lambda told_there: told_there[0])[1] if beside else math.nan

    def _fit(self, y: int, x: int, who: list[int]) -> float:
        layer = min(self.disparity[y, u] for u in who)
        nearest = min(abs(u - x) for u in who)
        begin = min([x] + [u - self.radius for u in who if u < x])
        end = max([x] + [u + self.radius for u in who if u > x])
        equations = []
        for v, u in self.asked:
            dx, dy, d = u - x, v - y, float(self.disparity[v, u])
            if not begin <= u <= end or abs(dy) > round(0.3 * self.radius):
                continue
            if abs(d - layer) >= self.settings.layer_px + self.settings.layer_growth * abs(dx):
                continue
            far = (math.hypot(dx, dy) - nearest) / (0.4 * self.radius)
            far += abs(self.picture[v, u] - self.picture[y, x]) / self.settings.grey_scale
            weight = (0.05 + self.confidence[v, u]) * max(1.0 - far / 64.0, 0.3) ** 64
            equations.append((weight, dx, dy, d))
        if sum(weight for weight, *_ in equations) <= 0.0:
            return float(layer)
        return plane_at_origin(np.array(equations), self.settings.slope_penalty_px2)


def asked_columns(support: NDArray, stride: int) -> list[int]:
    """Every stride-th pixel of each run of support."""
    asked, run = [], 0
    for x, is_support in enumerate(support):
        run = run + 1 if is_support else 0
        if is_support and (run - 1) % stride == 0:
            asked.append(x)
    return asked


def fitted_columns(first: int, last: int, who: list[int]) -> list[int]:
    """Both ends, and between them the sparser the further from those who speak."""
    fitted = [first]
    while fitted[-1] < last:
        near = min(abs(u - fitted[-1]) for u in who)
        fitted.append(min(fitted[-1] + min(1 + near // 2, 8), last))
    return fitted


def plane_at_origin(equations: NDArray, slope_penalty: float) -> float:
    """Value of the weighted plane at the origin, at most 1 px beyond what was measured."""
    weight, dx, dy, d = equations.T
    # The slopes' penalty as two more equations: a measured zero of either slope.
    pull = weight.sum() * slope_penalty
    root = np.sqrt(np.append(weight, [pull, pull]))
    design = np.column_stack([np.ones_like(dx), dx, dy])
    design = np.vstack([design, [[0, 1, 0], [0, 0, 1]]])
    target = np.append(d, [0.0, 0.0])
    value = np.linalg.lstsq(root[:, None] * design, root * target, rcond=None)[0][0]
    return min(max(value, d.min() - 1.0), d.max() + 1.0)
