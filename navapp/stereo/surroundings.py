"""A dense map of what lies around a surface: the coarse matches with their gaps filled.

To tell what stands where, for example a hand in front of a bone; never to measure with.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.halves import double, half_box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.coarse import SURFACE_CENSUS, CoarseMap, CoarseMatch
from navapp.stereo.matching.census_sgm import TwoViewDisparity, match_census
from navapp.stereo.matching.search import crop
from navapp.stereo.occlusion.classify import classify
from navapp.stereo.occlusion.wls_fill import FillSettings, fill_gaps
from navapp.values import DisparityMap, Origin, Surroundings

# All chosen, on simulated knees with a hand (`python -m tests.bench.foreground --first 1`).
# What stands before the searched band leaves a gap of at least so many pixels each way. It is
# matched in small windows, which hang less over its edges, and where both views agree roughly.
_LEAST_GAP_PX = 16
# The ends of a search are no minima: a pixel of the half beyond the band.
_BEYOND_PX = 2.0
_NEAR_CENSUS = replace(SURFACE_CENSUS, radius_x=1, radius_y=1, max_difference_px=3.0, speckle_px=40)
# A map to about a pixel needs no wider support.
_FILL = FillSettings(radius_px=8)


@dataclass(frozen=True, slots=True)
class NearerSearch:
    """How to search for what stands before the searched disparities."""

    nearest_px: float  # largest disparity of anything in view
    # the same pictures, rectified at 1/so much of their resolution, in a box of the reduced left
    # view and as far as a band of disparities reaches.
    rectify: Mapping[int, Callable[[Box, tuple[float, float]], RectifiedPair]]

    REDUCTIONS: ClassVar[tuple[int, int]] = (2, 4)  # asked for by maps at full, at half resolution


def match_nearer(coarse: CoarseMap, nearer: NearerSearch) -> CoarseMap:
    """The map, its matches joined with those of what stands before the searched band.

    That leaves a wide gap in the matches; without one the map is returned as it is. Its calm
    disparities stay: they tell of the band alone.
    """
    matched = coarse.matched
    gap = None if matched is None else _find_wide_gaps(matched.found.left)
    if matched is None or gap is None:
        return coarse
    return replace(coarse, matched=replace(matched, found=_add_nearer(matched, gap, nearer)))


def fill_surroundings(coarse: CoarseMap) -> Surroundings:
    """The matches of a coarse map, their gaps filled by weighted least squares (`fill_gaps`).

    A filled pixel has its class as origin: it is a guess.
    """
    matched = coarse.matched
    if matched is None:
        unknown = np.full_like(coarse.disparity_px, np.nan)
        nothing = np.zeros(unknown.shape, dtype=np.uint8)
        return Surroundings(unknown, nothing, coarse.box, False, nothing)
    pair, found = matched.pair, matched.found
    # The half of an odd picture lacks its last column or row, the half of a box has it.
    picture = crop(pair.left, pair.box, (0, 0))
    classes = classify(found.left, found.right_px, found.right_x0, pair.geometry.width, picture)
    disparity_px, origin = fill_gaps(found.left, picture, found.confidence, classes, _FILL)
    return Surroundings(disparity_px, origin, coarse.box, matched.is_half, picture)


def _find_wide_gaps(left: DisparityMap) -> Box | None:
    """Where something may stand before the band, which would not be matched; None if nowhere."""
    import cv2

    # Every other pixel tells it as well.
    is_gap = (left.origin[::2, ::2] == Origin.UNKNOWN).view(np.uint8)
    square = np.ones((_LEAST_GAP_PX // 2, _LEAST_GAP_PX // 2), np.uint8)
    x, y, width, height = cv2.boundingRect(cv2.erode(is_gap, square, borderValue=0))
    if width == 0:
        return None
    rows, columns = left.origin.shape
    inside = Box(2 * x, 2 * y, 2 * width, 2 * height).grow(_LEAST_GAP_PX).clip(columns, rows)
    return replace(inside, x=inside.x + left.x, y=inside.y + left.y)


def _add_nearer(matched: CoarseMatch, gap: Box, nearer: NearerSearch) -> TwoViewDisparity:
    """The matches with those of what stands before their band, at half their resolution."""
    found, left = matched.found, matched.found.left
    low, high = matched.band_px
    scale = 2 if matched.is_half else 1
    most_px = nearer.nearest_px / scale
    if most_px <= high + _BEYOND_PX:
        return found
    half_px = low / 2.0, most_px / 2.0
    half = nearer.rectify[2 * scale](half_box(gap), half_px)
    near = match_census(half, half_px, _NEAR_CENSUS)
    least_px = high + _BEYOND_PX
    near_px = np.float32(2.0) * double(near.left.disparity_px, gap)
    is_near = near_px > least_px
    if not is_near.any():
        return found
    there = gap.relative_to(left.box).slices
    disparity_px, sigma_px = left.disparity_px.copy(), left.sigma_px.copy()
    origin, confidence = left.origin.copy(), found.confidence.copy()
    np.copyto(disparity_px[there], near_px, where=is_near)
    sigma_px[there][is_near] = 2.0 * _NEAR_CENSUS.sigma_px
    origin[there][is_near] = Origin.MATCHED
    np.copyto(confidence[there], double(near.confidence, gap), where=is_near)
    right_px, right_x0 = _join_right(found, near, gap, least_px)
    joined = DisparityMap(disparity_px, sigma_px, origin, left.x, left.y)
    return TwoViewDisparity(right_px, right_x0, confidence, joined, found.agreement)


def _join_right(
    found: TwoViewDisparity, near: TwoViewDisparity, gap: Box, least_px: float
) -> tuple[NDArray[np.float32], int]:
    """The right view of both searches, and its first column: the nearer one hides the other."""
    beyond = replace(gap, x=2 * near.right_x0, width=2 * near.right_px.shape[1])
    near_px = np.float32(2.0) * double(near.right_px, beyond)
    height, width = found.right_px.shape
    first = min(beyond.x, found.right_x0)
    after = max(beyond.x + beyond.width, found.right_x0 + width)
    right_px = np.full((height, after - first), np.nan, dtype=np.float32)
    right_px[:, found.right_x0 - first :][:, :width] = found.right_px
    part = right_px[gap.y - found.left.y :, beyond.x - first :][: gap.height, : beyond.width]
    np.copyto(part, near_px, where=near_px > least_px)
    return right_px, first
