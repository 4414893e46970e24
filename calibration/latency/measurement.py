"""Measures the lag of each eye behind a code, and from both the display's delay and the skew."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from calibration.latency.display_area import Area, WatchedCells, find_area
from calibration.latency.lag_fit import (
    COARSE_WIDTH_MS,
    WIDTHS_MS,
    BlockSums,
    compute_block_sums,
    draw_counts,
    list_coarse_lags_ms,
    list_fine_lags_ms,
)
from calibration.latency.light_code import SHORTEST_PAUSE_MS, Switches
from navapp.geometry.transform import FloatArray

# Enough for the blocks to scatter as frames do, and for a standard deviation known to an eighth.
_FRAMES_A_BLOCK, _MOST_BLOCKS = 8, 30
# Lags that are farther apart belong to different peaks: half of the shortest pause.
_SAME_PEAK_MS = 0.5 * SHORTEST_PAUSE_MS
# A frame is all dark or all lit but for rounding.
_WHOLE = 1e-6
# Student's 95 % with thirty blocks.
_T95 = 2.05


@dataclass(frozen=True, slots=True)
class Estimate:
    """A time and its standard error."""

    value_ms: float
    sigma_ms: float  # its standard error

    @property
    def bound_ms(self) -> float:
        """95 % of the errors are smaller."""
        return _T95 * self.sigma_ms


@dataclass(frozen=True, slots=True)
class EyeLag:
    """Lag of one eye behind the code, and how well the code explains its pictures."""

    # from the call that changed the display to the change in the pictures, on their stamps.
    lag: Estimate
    width_ms: float  # of the window in which a switch is seen: exposure and spread together
    drift: Estimate  # how much later the second half of the frames saw it than the first
    swing: float  # grey values between darkness and light
    area_fraction: float  # of the picture
    explained: float  # share of the area's changes that the code explains
    wrong_fraction: float  # frames that saw light where the code says darkness, or the reverse
    other_peak_fraction: float  # of resampled recordings that another delay fits better


@dataclass(frozen=True, slots=True)
class Latency:
    """Result of a latency measurement."""

    # left, right: the eyes.
    left: EyeLag
    right: EyeLag
    # how much later the right eye exposes than the stamps of its pictures say, the left one taken
    # as it is.
    late: Estimate
    stamped_ms: float  # how much later it exposes by the stamps; median
    # n_frames, n_switches: that were used.
    n_frames: int
    n_switches: int

    @property
    def delay(self) -> Estimate:
        """From the call to the light, on the stamps of the left eye, which are the frames'."""
        return self.left.lag

    @property
    def offset(self) -> Estimate:
        """From the left exposure to the right one of a pair."""
        return Estimate(self.stamped_ms + self.late.value_ms, self.late.sigma_ms)


def measure_latency(switches: Switches, left: WatchedCells, right: WatchedCells) -> Latency:
    """Fit the code to what both eyes saw of it.

    A frame's brightness is that of the display over a window around its stamp, some lag before.
    The lag and the width of that window that explain most of the area's changes are taken; light
    and darkness come out of the same least squares. Standard errors are the scatter over recordings
    put together from blocks of this one, the same blocks for both eyes: what moves a switch moves
    it for both, and drops out of their difference.

    Args:
        switches: when the display was told to change.
        left: n frames of that eye.
        right: the frames of the same pairs.
    """
    one, other = _Eye(switches, left), _Eye(switches, right)
    late_ms = one.lag_ms - other.lag_ms
    return Latency(
        left=one.lag(),
        right=other.lag(),
        late=Estimate(late_ms, float(np.std(one.drawn_lags_ms - other.drawn_lags_ms))),
        stamped_ms=float(np.median(right.times_ms - left.times_ms)),
        n_frames=len(left.times_ms),
        n_switches=len(switches.times_ms),
    )


class _Eye:
    """One eye's area, its brightness, and the sums at the width that explains most."""

    def __init__(self, switches: Switches, watched: WatchedCells) -> None:
        n_blocks = max(min(_MOST_BLOCKS, len(watched.times_ms) // _FRAMES_A_BLOCK), 2)
        self._switches, self._times_ms = switches, watched.times_ms
        self._area: Area = find_area(switches, watched)
        self._grey = self._area.series(watched)
        ends = np.linspace(0, len(self._times_ms), n_blocks + 1).astype(int)
        self._blocks = [slice(a, b) for a, b in pairwise(ends)]
        self._once, self._draws = np.ones((1, n_blocks)), draw_counts(n_blocks)
        lags_ms = list_fine_lags_ms(self._area.lag_ms)
        by_width = [(self._sums(lags_ms, width_ms), width_ms) for width_ms in WIDTHS_MS]
        best = max(by_width, key=lambda one: one[0].compute_explained(self._once).max())
        self._best, self._width_ms = best
        self.lag_ms = float(self._best.best_lags_ms(self._once)[0])
        self.drawn_lags_ms = self._best.best_lags_ms(self._draws)

    def lag(self) -> EyeLag:
        """What is said of this eye."""
        lags_ms = np.array([self.lag_ms])
        share = self._switches.compute_lit_fractions(self._times_ms, lags_ms, self._width_ms)[:, 0]
        is_dark, is_lit = share < _WHOLE, share > 1.0 - _WHOLE
        dark, lit = _median(self._grey[is_dark]), _median(self._grey[is_lit])
        is_light = self._grey > 0.5 * (dark + lit)
        is_wrong = (is_light & is_dark) | (~is_light & is_lit)
        return EyeLag(
            lag=Estimate(self.lag_ms, float(np.std(self.drawn_lags_ms))),
            width_ms=self._width_ms,
            drift=self._drift(),
            swing=lit - dark,
            area_fraction=float(self._area.is_in.mean()),
            explained=float(self._best.compute_explained(self._once).max()),
            wrong_fraction=float(is_wrong.mean()),
            other_peak_fraction=self._other_peak_fraction(),
        )

    def _sums(self, lags_ms: FloatArray, width_ms: float) -> BlockSums:
        shares = self._switches.compute_lit_fractions(self._times_ms, lags_ms, width_ms)
        return compute_block_sums(shares, self._grey, self._blocks, lags_ms)

    def _drift(self) -> Estimate:
        """Second half less first half."""
        n = len(self._blocks)
        is_first = np.arange(n) < n // 2
        halves = [self._half(is_half) for is_half in (is_first, ~is_first)]
        later_ms = halves[1].value_ms - halves[0].value_ms
        return Estimate(later_ms, math.hypot(halves[0].sigma_ms, halves[1].sigma_ms))

    def _half(self, is_half: NDArray[np.bool_]) -> Estimate:
        found_ms = self._best.best_lags_ms(is_half[None].astype(np.float64))[0]
        drawn_ms = self._best.best_lags_ms(draw_counts(len(self._blocks), is_half))
        return Estimate(float(found_ms), float(np.std(drawn_ms)))

    def _other_peak_fraction(self) -> float:
        sums = self._sums(list_coarse_lags_ms(), COARSE_WIDTH_MS)
        away_ms = np.abs(sums.best_lags_ms(self._draws) - self._area.lag_ms)
        return float(np.mean(away_ms > _SAME_PEAK_MS))


def _median(values: FloatArray) -> float:
    return float(np.median(values)) if len(values) else 0.0
