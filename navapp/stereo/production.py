"""The stereo chain without and with a pose: match, then fill what one camera cannot see."""

import time
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.census_sgm import CensusSettings, match_census
from navapp.stereo.gradient import match_gradient, smooth_known
from navapp.stereo.occlusion import classify
from navapp.stereo.refine import refine
from navapp.stereo.wls_fill import FillSettings, fill_wls
from navapp.values import DisparityMap, LineTimings

Matcher = Literal["gradient", "production"]

# Below this share of left-right agreement the two pictures do not show the same scene that way
# round: with left and right swapped a few per cent agree by chance, otherwise far more than half.
_LEAST_AGREEMENT = 0.15

_SUPPORT_SIGMA_PX = 2.0
# Further away than this, a refined value is not the same surface's any more.
_CLOSE_PX = 1.0
# A window over an edge mixes two surfaces: there the coarse value stands.
_WINDOW_PX = 11
_SAME_SURFACE_PX = 3.0
_WIDE_SEARCH_PX = 160


@dataclass(frozen=True, slots=True, eq=False)
class StereoAnswer:
    """A disparity map, what was measured before the fill, and what is to be said about it."""

    disparity: DisparityMap
    matched: DisparityMap
    reasons: tuple[str, ...]
    timings: LineTimings


def match_without_pose(
    pair: RectifiedPair,
    band_px: tuple[float, float],
    *,
    fills: bool,
    max_gap_px: int | None = None,
) -> StereoAnswer:
    """Census and semi-global matching, refined where the texture allows, occlusions filled.

    Args:
        pair: rectified grey pictures; `pair.box` is matched.
        band_px: smallest and largest disparity expected.
        fills: weighted least squares fill, in the paper's directions.
        max_gap_px: a pixel further from what was measured stays unknown; None fills everything.
    """
    started = time.perf_counter_ns()
    found = match_census(pair, band_px, _settings_for(band_px))
    if found.agreement < _LEAST_AGREEMENT:
        nothing = _nothing_of(found.left)
        why = "left and right hardly agree: are the pictures swapped, black or of another scene?"
        return StereoAnswer(nothing, nothing, (why,), LineTimings(stereo_ms=_ms(started)))
    matched = _refined(pair, found.left)
    timings = LineTimings(stereo_ms=_ms(started))
    if not fills:
        return StereoAnswer(matched, matched, (), timings)
    started = time.perf_counter_ns()
    picture = _box_of(pair)
    classes = classify(matched, found.right_px, found.right_x0, pair.geometry.width, picture)
    filled = fill_wls(
        matched, picture, found.confidence, classes, FillSettings(max_gap_px=max_gap_px)
    )
    return StereoAnswer(filled, matched, (), replace(timings, fill_ms=_ms(started)))


def match_on_support(pair: RectifiedPair, support_px: NDArray[np.float32]) -> StereoAnswer:
    """Sub-pixel matching where a predicted surface says what to expect; nothing is filled."""
    started = time.perf_counter_ns()
    matched = refine(pair, support_px)
    return StereoAnswer(matched, matched, (), LineTimings(stereo_ms=_ms(started)))


def match_baseline(pair: RectifiedPair, band_px: tuple[float, float]) -> StereoAnswer:
    """The paper's state of the art: gradient magnitudes, winner takes all, Gaussian; no fill."""
    started = time.perf_counter_ns()
    matched = match_gradient(pair, band_px)
    return StereoAnswer(matched, matched, (), LineTimings(stereo_ms=_ms(started)))


def _refined(pair: RectifiedPair, coarse: DisparityMap) -> DisparityMap:
    """Sub-pixel values where they settle close to the coarse ones, the coarse ones elsewhere."""
    # Smoothed only to make a support: a map that was smoothed itself would be tilted.
    finer = refine(pair, smooth_known(coarse.disparity_px, _SUPPORT_SIGMA_PX))
    with np.errstate(invalid="ignore"):
        is_finer = np.abs(finer.disparity_px - coarse.disparity_px) < _CLOSE_PX
    is_finer &= _local_range_px(coarse.disparity_px) < _SAME_SURFACE_PX
    return replace(
        coarse,
        disparity_px=np.where(is_finer, finer.disparity_px, coarse.disparity_px),
        sigma_px=np.where(is_finer, finer.sigma_px, coarse.sigma_px),
    )


def _local_range_px(disparity_px: NDArray[np.float32]) -> NDArray[np.float32]:
    """Largest minus smallest known disparity in each pixel's window."""
    import cv2

    window = np.ones((_WINDOW_PX, _WINDOW_PX), dtype=np.uint8)
    known = np.isfinite(disparity_px)
    largest = cv2.dilate(np.where(known, disparity_px, np.float32(-1e6)), window)
    smallest = cv2.erode(np.where(known, disparity_px, np.float32(1e6)), window)
    return np.asarray(largest - smallest, dtype=np.float32)


def _settings_for(band_px: tuple[float, float]) -> CensusSettings:
    """Larger windows and penalties for a wide search: the same scene in more pixels."""
    if band_px[1] - band_px[0] < _WIDE_SEARCH_PX:
        return CensusSettings()
    return CensusSettings(radius_x=4, radius_y=3, p1=20, p2=120)


def _nothing_of(found: DisparityMap) -> DisparityMap:
    unknown = np.full_like(found.disparity_px, np.nan)
    return replace(
        found, disparity_px=unknown, sigma_px=unknown, origin=np.zeros_like(found.origin)
    )


def _box_of(pair: RectifiedPair) -> NDArray[np.uint8]:
    box = pair.box
    return pair.left[box.y : box.y + box.height, box.x : box.x + box.width]


def _ms(started_ns: int) -> float:
    return (time.perf_counter_ns() - started_ns) / 1e6
