"""Compiled search for edges along the normals of an outline: where one picture has it."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.tracking.outline_kernels import Rim

# All chosen, but where a source is named. Distance of the samples along a normal.
_STEP_PX = 0.5
# Edges are found by the derivative of a Gaussian, over so many samples to either side.
_SIGMA_PX, _TAPS = 0.8, 6
# Samples to either side in which the steepest slope is searched, and in which it must lie.
_SEARCH, _NEAR_ENOUGH = 9, 4
_HALF = _SEARCH + _TAPS
# The levels beside an edge are means over the samples from the first of these to the last.
_LEVEL_FROM, _FLANK = 4, 8
# Where behind the outline it is less dark than this, the edge is as often that of tissue on the
# bone (python -m tests.bench.outline; docs/how/registration.md).
_LEAST_MISSING = 0.7

_TAPS_PX = _STEP_PX * np.arange(-_TAPS, _TAPS + 1)
_GAUSSIAN = np.exp(-0.5 * (_TAPS_PX / _SIGMA_PX) ** 2)
_DERIVATIVE = -_TAPS_PX * _GAUSSIAN / (_GAUSSIAN * _TAPS_PX * _TAPS_PX).sum()


@njit(cache=True, nogil=True)
def sample_across(
    picture: NDArray[np.uint8],
    middle: tuple[float, float],
    normal: tuple[float, float],
    profile: NDArray[np.float64],
) -> bool:
    """Grey values along a normal, the mean over three lines a pixel apart; False out of view.

    Args:
        picture: (h, w).
        middle: x and y px of the middle sample.
        normal: its unit direction.
        profile: (2 K + 1,) in place.
    """
    (x, y), (ux, uy) = middle, normal
    half = profile.shape[0] // 2
    reach = _STEP_PX * half + 2.0
    if not (reach <= x < picture.shape[1] - reach and reach <= y < picture.shape[0] - reach):
        return False
    for k in range(profile.shape[0]):
        total = 0.0
        for side in range(-1, 2):
            px = x + _STEP_PX * (k - half) * ux - side * uy
            py = y + _STEP_PX * (k - half) * uy + side * ux
            c, r = int(np.floor(px)), int(np.floor(py))
            fx, fy = px - c, py - r
            total += (1.0 - fy) * ((1.0 - fx) * picture[r, c] + fx * picture[r, c + 1])
            total += fy * ((1.0 - fx) * picture[r + 1, c] + fx * picture[r + 1, c + 1])
        profile[k] = total / 3.0
    return True


@njit(cache=True, nogil=True)
def find_strongest_edge(profile: NDArray[np.float64]) -> float:
    """Place of the steepest slope of a profile, px from its middle; NaN when not near it.

    Only the strongest counts, bright or dark inside: a weaker one nearby is not the outline.
    """
    middle = profile.shape[0] // 2
    slope = np.empty(2 * _SEARCH + 1)
    for k in range(-_SEARCH, _SEARCH + 1):
        total = 0.0
        for tap in range(-_TAPS, _TAPS + 1):
            total -= _DERIVATIVE[tap + _TAPS] * profile[middle + k + tap]
        slope[k + _SEARCH] = abs(total)
    best = int(slope.argmax())
    if abs(best - _SEARCH) > _NEAR_ENOUGH:
        return np.nan
    # The vertex of a parabola through three slopes.
    before, here, after = slope[best - 1], slope[best], slope[best + 1]
    bend = before - 2.0 * here + after
    part = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return _STEP_PX * (best - _SEARCH + min(max(part, -0.5), 0.5))


@njit(cache=True, nogil=True)
def measure_missing_fraction(profile: NDArray[np.float64]) -> float:
    """Fraction of the level inside an edge, which is the middle of a profile, missing outside."""
    middle = profile.shape[0] // 2
    inside = profile[: middle - _LEVEL_FROM + 1].mean()
    outside = profile[middle + _LEVEL_FROM :].mean()
    fraction: float = (inside - outside) / max(inside, 1.0)
    return fraction


@njit(cache=True, nogil=True)
def measure_edge_offsets(picture: NDArray[np.uint8], rim: Rim) -> NDArray[np.float64]:
    """(N,) px from each point of a rim to its picture's edge along the normal; NaN without one."""
    wide, flank = np.empty(2 * _HALF + 1), np.empty(2 * _FLANK + 1)
    offset = np.full(rim.pixel.shape[0], np.nan)
    for i in range(len(offset)):
        x, y, ux, uy = rim.pixel[i, 0], rim.pixel[i, 1], rim.normal[i, 0], rim.normal[i, 1]
        if not sample_across(picture, (x, y), (ux, uy), wide):
            continue
        if wide[_HALF:].min() > (1.0 - _LEAST_MISSING) * wide[: _HALF + 1].max():
            continue
        at = find_strongest_edge(wide)
        if np.isnan(at) or not sample_across(picture, (x + at * ux, y + at * uy), (ux, uy), flank):
            continue
        if measure_missing_fraction(flank) >= _LEAST_MISSING:
            offset[i] = at
    return offset
