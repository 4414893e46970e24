"""Finds the cells of a camera's pictures whose brightness follows the display's code."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.latency.lag_fit import COARSE_WIDTH_MS, list_coarse_lags_ms
from calibration.latency.light_code import Switches
from navapp.geometry.transform import FloatArray

# A cell belongs to the display that swings by so much of what the greatest swing is.
_LEAST_SWING = 0.5
_TURN_MS = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class WatchedCells:
    """Grey values of one eye's pictures, frame by frame."""

    times_ms: FloatArray  # (n,) stamps of its exposures, rising
    cells: NDArray[np.float32]  # (n, c) mean grey value of every cell of its pictures

    def only(self, is_in: NDArray[np.bool_]) -> "WatchedCells":
        """Some (n,) of its frames."""
        return WatchedCells(self.times_ms[is_in], self.cells[is_in])


@dataclass(frozen=True, slots=True, eq=False)
class Area:
    """The cells of a camera's pictures that follow the code."""

    is_in: NDArray[np.bool_]  # (c,) these cells
    lag_ms: float  # at which they follow it, coarsely

    def series(self, watched: WatchedCells) -> FloatArray:
        """(n,) their mean grey value."""
        return np.asarray(watched.cells[:, self.is_in].mean(axis=1), dtype=np.float64)


def find_area(switches: Switches, watched: WatchedCells) -> Area:
    """The cells that swing with the code, at the lag at which all together swing most."""
    lags_ms = list_coarse_lags_ms()
    shares = switches.compute_lit_fractions(watched.times_ms, lags_ms, COARSE_WIDTH_MS)
    shares = shares - shares.mean(axis=0)
    cells = watched.cells - watched.cells.mean(axis=0)
    squares = np.maximum((shares**2).sum(axis=0), 1e-9)
    swings = np.maximum(shares.T @ cells / squares[:, None], 0.0)
    best = int(np.argmax((swings**2).sum(axis=1)))
    return Area(swings[best] >= _LEAST_SWING * swings[best].max(), float(lags_ms[best]))


def compute_seen_deviations(switches: Switches, watched: WatchedCells) -> float:
    """By how many standard deviations the code is seen.

    Among hundreds of cells some follow any code by chance. So the area is found in the frames of
    every other second, and asked for in the rest, where chance correlates as 1 / sqrt(n).
    """
    is_finding = (watched.times_ms // _TURN_MS).astype(np.int64) % 2 == 0
    finding, asked = watched.only(is_finding), watched.only(~is_finding)
    if min(len(finding.times_ms), len(asked.times_ms)) == 0:
        return 0.0
    area = find_area(switches, finding)
    lag_ms = np.array([area.lag_ms])
    share = switches.compute_lit_fractions(asked.times_ms, lag_ms, COARSE_WIDTH_MS)[:, 0]
    grey = area.series(asked)
    scatter = float(share.std() * grey.std())
    if scatter == 0.0:
        return 0.0
    together = float(np.mean((share - share.mean()) * (grey - grey.mean())))
    return together / scatter * float(np.sqrt(len(grey)))
