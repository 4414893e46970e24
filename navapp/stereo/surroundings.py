"""A dense map of what lies around a surface: the coarse matches, and guesses in their gaps.

To tell what stands where, for example a hand in front of a bone; never to measure with.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.stereo.coarse import SURFACE_CENSUS, CoarseMap, CoarseMatch, double, halve
from navapp.stereo.matching.census_sgm import TwoViewDisparity, match_census
from navapp.stereo.occlusion.classify import classify
from navapp.stereo.occlusion.impossible_kernels import mark_impossible
from navapp.stereo.occlusion.wls_fill import fill_wls
from navapp.values import DisparityMap, Origin

# All chosen, on simulated knees with a hand (`python -m tests.bench.foreground --first 1`).
# What stands before the searched band leaves a gap of at least so many pixels each way. It is
# matched in small windows, which hang less over its edges, and where both views agree roughly.
_LEAST_GAP_PX = 16
_NEAR_CENSUS = replace(SURFACE_CENSUS, radius_x=1, radius_y=1, max_difference_px=3.0, speckle_px=40)
# A guess may be nearer than what hides it leaves room for, and differ from its neighbours, by so
# much: edges and surfaces are known to about as much.
_EDGE_PX, _LAYER_PX = np.float32(2.0), np.float32(8.0)


def fill_surroundings(coarse: CoarseMap) -> DisparityMap:
    """The matches of a coarse map at full size, their gaps filled by weighted least squares.

    What stands before the searched band is matched too. Gaps are classified and filled along the
    picture's edges (`fill_wls`), a match that hangs over the edge of something near is withdrawn
    first, and a guess that cannot be is dropped. What is no match keeps its class as origin: its
    disparity is a guess.
    """
    matched = coarse.matched
    if matched is None:
        unknown = np.full_like(coarse.disparity_px, np.nan)
        origin = np.zeros(unknown.shape, dtype=np.uint8)
        return DisparityMap(unknown, unknown, origin, coarse.box.x, coarse.box.y)
    pair, found = matched.pair, matched.found
    if _has_wide_gap(found.left):
        found = _add_nearer(matched)
    picture = pair.left[pair.box.slices]
    classes = classify(found.left, found.right_px, found.right_x0, pair.geometry.width, picture)
    filled = fill_wls(found.left, picture, found.confidence, classes)
    is_impossible = np.empty(filled.origin.shape, dtype=np.bool_)
    mark_impossible(filled.disparity_px, filled.origin, _EDGE_PX, _LAYER_PX, is_impossible)
    filled = filled.only(~is_impossible)
    return filled if pair.box == coarse.box else _double_map(filled, coarse.box)


def _has_wide_gap(left: DisparityMap) -> bool:
    """Whether something may stand before the band: it would not be matched."""
    import cv2

    is_gap = (left.origin == Origin.UNKNOWN).view(np.uint8)
    square = np.ones((_LEAST_GAP_PX, _LEAST_GAP_PX), np.uint8)
    return bool(cv2.erode(is_gap, square, borderValue=0).any())


def _add_nearer(matched: CoarseMatch) -> TwoViewDisparity:
    """The matches with those of what stands before their band, at half their resolution."""
    found, box = matched.found, matched.pair.box
    low, high = matched.band_px
    half = halve(matched.pair, (low, matched.nearest_px))
    near = match_census(half, (low / 2.0, matched.nearest_px / 2.0), _NEAR_CENSUS)
    # The ends of a search are no minima: a pixel of the half beyond the band.
    least_px = high + 2.0
    near_px = np.float32(2.0) * double(near.left.disparity_px, box)
    is_near = near_px > least_px
    if not is_near.any():
        return found
    left = DisparityMap(
        np.where(is_near, near_px, found.left.disparity_px),
        np.where(is_near, 2.0 * double(near.left.sigma_px, box), found.left.sigma_px),
        np.where(is_near, np.uint8(Origin.MATCHED), found.left.origin),
        box.x,
        box.y,
    )
    confidence = np.where(is_near, double(near.confidence, box), found.confidence)
    right_px, right_x0 = _join_right(found, near, box, least_px)
    return TwoViewDisparity(left, right_px, right_x0, confidence, found.agreement)


def _join_right(
    found: TwoViewDisparity, near: TwoViewDisparity, box: Box, least_px: float
) -> tuple[NDArray[np.float32], int]:
    """The right view of both searches, and its first column: the nearer one hides the other."""
    beyond = replace(box, x=2 * near.right_x0, width=2 * near.right_px.shape[1])
    near_px = np.float32(2.0) * double(near.right_px, beyond)
    first = min(beyond.x, found.right_x0)
    after = max(beyond.x + beyond.width, found.right_x0 + found.right_px.shape[1])
    right_px = np.full((box.height, after - first), np.nan, dtype=np.float32)
    right_px[:, found.right_x0 - first :][:, : found.right_px.shape[1]] = found.right_px
    part = right_px[:, beyond.x - first :][:, : beyond.width]
    np.copyto(part, near_px, where=near_px > least_px)
    return right_px, first


def _double_map(half: DisparityMap, box: Box) -> DisparityMap:
    """Over a box of the whole, from a map over `half_box(box)`; each pixel as its half pixel."""
    disparity_px, sigma_px = (
        np.float32(2.0) * double(px, box) for px in (half.disparity_px, half.sigma_px)
    )
    return DisparityMap(disparity_px, sigma_px, double(half.origin, box), box.x, box.y)
