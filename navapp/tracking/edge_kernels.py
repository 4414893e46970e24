"""Compiled search for edges along the normals of an outline: where one picture has it."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.tracking.outline_kernels import Rim

# Samples along the normal, and the derivative of a Gaussian that finds edges in them.
_STEP_PX, _SIGMA_PX = 0.5, 0.8
_TAPS = 6
_SEARCH, _NEAR_ENOUGH = 9, 4
_HALF = _SEARCH + _TAPS
# The levels on either side of an edge, from so many samples, the ones next to it left out.
_FLANK, _LEVEL_FROM = 8, 4


def _derivative() -> NDArray[np.float64]:
    at = _STEP_PX * np.arange(-_TAPS, _TAPS + 1)
    weight = np.exp(-0.5 * (at / _SIGMA_PX) ** 2)
    slope: NDArray[np.float64] = -at * weight / (weight * at * at).sum()
    return slope


DERIVATIVE = _derivative()


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
def strongest_edge(profile: NDArray[np.float64]) -> float:
    """Place of the steepest slope of a profile, px from its middle; NaN when not near it.

    Bright inside or dark inside: only the strongest counts, so that a weaker slope nearby is not
    taken for the outline.
    """
    middle = profile.shape[0] // 2
    slope = np.empty(2 * _SEARCH + 1)
    for k in range(-_SEARCH, _SEARCH + 1):
        total = 0.0
        for tap in range(-_TAPS, _TAPS + 1):
            total -= DERIVATIVE[tap + _TAPS] * profile[middle + k + tap]
        slope[k + _SEARCH] = abs(total)
    best = int(slope.argmax())
    if abs(best - _SEARCH) > _NEAR_ENOUGH:
        return np.nan
    before, here, after = slope[best - 1], slope[best], slope[best + 1]
    bend = before - 2.0 * here + after
    part = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return _STEP_PX * (best - _SEARCH + min(max(part, -0.5), 0.5))


@njit(cache=True, nogil=True)
def missing_share(profile: NDArray[np.float64]) -> float:
    """Share of the level inside an edge that is missing outside.

    Args:
        profile: grey values across the edge, from inside to outside, its middle on it.
    """
    middle = profile.shape[0] // 2
    inside = profile[: middle - _LEVEL_FROM + 1].mean()
    outside = profile[middle + _LEVEL_FROM :].mean()
    share: float = (inside - outside) / max(inside, 1.0)
    return share


@njit(cache=True, nogil=True)
def find_steps(picture: NDArray[np.uint8], rim: Rim, darker: float) -> NDArray[np.float64]:
    """(N,) px from each point to the picture's edge along the normal; NaN without one.

    Args:
        picture: (h, w).
        rim: of the eye that took it.
        darker: least share of the level inside that is missing outside.
    """
    wide, flank = np.empty(2 * _HALF + 1), np.empty(2 * _FLANK + 1)
    offset = np.full(rim.pixel.shape[0], np.nan)
    for i in range(len(offset)):
        x, y, ux, uy = rim.pixel[i, 0], rim.pixel[i, 1], rim.normal[i, 0], rim.normal[i, 1]
        if not sample_across(picture, (x, y), (ux, uy), wide):
            continue
        if wide[_HALF:].min() > (1.0 - darker) * wide[: _HALF + 1].max():
            continue
        at = strongest_edge(wide)
        if np.isnan(at) or not sample_across(picture, (x + at * ux, y + at * uy), (ux, uy), flank):
            continue
        if missing_share(flank) >= darker:
            offset[i] = at
    return offset
