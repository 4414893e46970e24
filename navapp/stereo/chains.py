"""The stereo chains: match, then fill what one camera cannot see."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.coarse import LEAST_AGREEMENT, CoarseMatch, clip_box, smooth_steps
from navapp.stereo.matching.census_sgm import CensusSettings, FillEvidence, match_census
from navapp.stereo.matching.gradient import match_gradient, smooth_known
from navapp.stereo.occlusion.classify import classify, project_to_right
from navapp.stereo.occlusion.wls_fill import FillSettings, fill_wls
from navapp.stereo.subpixel.coarse_to_fine import refine_scene, refine_surface
from navapp.stereo.subpixel.refine import refine_on_model, without_specks
from navapp.values import DisparityMap, FrameTimings, Stopwatch

_DISAGREEMENT = "left and right hardly agree: are the pictures swapped or of another scene?"
_NO_CONTRAST = "no part of the pictures has any contrast: are they black or saturated?"
_LEAST_IN_PATCHES = 0.5
_NOT_CONFIRMED = (
    "the surface is not where the pose says: is the pose right, are the pictures swapped?"
)

_WIDE_SEARCH_PX = 160

# Of the paper's Gaussian filter over the disparity, px; chosen.
_GAUSSIAN_SIGMA_PX = 1.0
# A claimed sigma below this says no more.
_BEST_SIGMA_PX = np.float32(0.1)


@dataclass(frozen=True, slots=True, eq=False)
class StereoAnswer:
    """A disparity map, what was measured before the fill, and what is to be said about it."""

    disparity: DisparityMap
    matched: DisparityMap
    reasons: tuple[str, ...]
    timings: FrameTimings


def match_scene(pair: RectifiedPair, band_px: tuple[float, float], *, fills: bool) -> StereoAnswer:
    """The whole scene, edges and all: every match is kept, refined where the texture allows.

    Census and semi-global matching at full resolution.

    Args:
        pair: rectified grey pictures; the part of `pair.box` inside them is matched.
        band_px: smallest and largest disparity expected.
        fills: weighted least squares fill, in the paper's directions.
    """
    watch = Stopwatch()
    pair = clip_box(pair)
    found = match_census(pair, band_px, _settings_for(band_px))
    if not found.agreement >= LEAST_AGREEMENT:
        return _nothing(pair, _why(found.agreement), watch)
    left = refine_scene(pair, found.left)
    return _answer(pair, left, found, FillSettings() if fills else None, watch)


def match_surface(
    pair: RectifiedPair, band_px: tuple[float, float], *, fills: bool, max_gap_px: int | None = None
) -> StereoAnswer:
    """Smooth surfaces for measuring: to a part of a pixel, or unknown.

    Census and semi-global matching, at half resolution where that leaves enough of the picture,
    tell where; `refine_surface` measures. Arguments as for `match_scene`; a pixel further than
    `max_gap_px` from what was measured stays unknown, None fills everything.
    """
    watch = Stopwatch()
    pair = clip_box(pair)
    coarse = CoarseMatch.of(pair, band_px)
    found = coarse.found
    if not found.agreement >= LEAST_AGREEMENT:
        return _nothing(pair, _why(found.agreement), watch)
    surface_px = coarse.at_full(smooth_steps(found.left.disparity_px), pair.box)
    left = refine_surface(pair, surface_px)
    fill = FillSettings(max_gap_px=max_gap_px) if fills else None
    return _answer(pair, left, coarse.fill_evidence(pair.box), fill, watch)


def match_on_support(
    pair: RectifiedPair,
    support_px: NDArray[np.float32],
    *,
    fills: bool,
    max_gap_px: int | None = None,
) -> StereoAnswer:
    """Sub-pixel matching where a predicted surface says what to expect.

    Args:
        pair: rectified grey pictures; `pair.box` is matched.
        support_px: (h, w) float32 expected disparity; NaN where none is expected, nor filled.
        fills: from what was measured, never from the support.
        max_gap_px: a pixel further from what was measured stays unknown; None fills everything.
    """
    watch = Stopwatch()
    left = refine_on_model(pair, support_px)
    if np.isfinite(support_px).any() and not (left.origin > 0).any():
        return _nothing(pair, _NOT_CONFIRMED, watch)
    if not fills:
        watch.lap("stereo")
        return StereoAnswer(left, left, (), watch.timings)
    # What the right camera sees of the support is all that is known of its view.
    right_px = project_to_right(support_px, left.x, pair.geometry.width)
    evidence = FillEvidence(right_px, 0, _by_sigma(left))
    fill = FillSettings(max_gap_px=max_gap_px)
    return _answer(pair, left, evidence, fill, watch, np.isfinite(support_px))


def match_baseline(
    pair: RectifiedPair, band_px: tuple[float, float], *, fills: bool = False
) -> StereoAnswer:
    """As the paper does: gradient magnitudes, winner takes all, Gaussian filter.

    Filled, it is the paper's proposal (section 3.2): occlusions by weighted least squares before
    the filter. Matches that hang over an edge are withdrawn as in the other chains, which the paper
    does not do. Without, it is its state of the art (section 3.1). Arguments as for `match_scene`.
    """
    watch = Stopwatch()
    pair = clip_box(pair)
    found = match_gradient(pair, band_px)
    matched_fraction = found.left.matched_fraction
    # Matches of chance stand alone.
    in_patches = without_specks(found.left).matched_fraction
    if matched_fraction == 0.0:
        return _nothing(pair, _NO_CONTRAST, watch)
    if in_patches < _LEAST_IN_PATCHES * matched_fraction:
        return _nothing(pair, _DISAGREEMENT, watch)
    answer = _answer(pair, found.left, found, FillSettings() if fills else None, watch)
    # The paper's noise filter, over the known pixels.
    smooth_px = smooth_known(answer.disparity.disparity_px, _GAUSSIAN_SIGMA_PX)
    smooth = replace(answer.disparity, disparity_px=smooth_px)
    watch.lap("fill" if fills else "stereo")
    return replace(answer, disparity=smooth, timings=watch.timings)


def _answer(
    pair: RectifiedPair,
    left: DisparityMap,
    evidence: FillEvidence,
    fill: FillSettings | None,
    watch: Stopwatch,
    is_expected: NDArray[np.bool_] | None = None,
) -> StereoAnswer:
    """The answer, its occlusions filled where that is wanted and a surface is expected."""
    watch.lap("stereo")
    if fill is None:
        return StereoAnswer(left, left, (), watch.timings)
    picture = pair.left[pair.box.slices]
    classes = classify(left, evidence.right_px, evidence.right_x0, pair.geometry.width, picture)
    if is_expected is not None:
        classes[~is_expected] = 0
    filled = fill_wls(left, picture, evidence.confidence, classes, fill)
    watch.lap("fill")
    return StereoAnswer(filled, left, (), watch.timings)


def _by_sigma(left: DisparityMap) -> NDArray[np.float32]:
    """(h, w) confidence, 0 to 1: the smaller the claimed sigma, the larger; 0 where unmatched."""
    sigma_px = np.maximum(left.sigma_px, _BEST_SIGMA_PX)
    return np.nan_to_num(_BEST_SIGMA_PX / sigma_px).astype(np.float32)


def _settings_for(band_px: tuple[float, float]) -> CensusSettings:
    """Larger windows and penalties for a wide search: the same scene in more pixels."""
    if band_px[1] - band_px[0] < _WIDE_SEARCH_PX:
        return CensusSettings()
    return CensusSettings(radius_x=4, radius_y=3, p1=20, p2=120)


def _why(agreement: float) -> str:
    return _NO_CONTRAST if np.isnan(agreement) else _DISAGREEMENT


def _nothing(pair: RectifiedPair, why: str, watch: Stopwatch) -> StereoAnswer:
    """An empty map, and the reason."""
    box = pair.box
    unknown = np.full((box.height, box.width), np.nan, dtype=np.float32)
    nothing = DisparityMap(unknown, unknown, np.zeros(unknown.shape, np.uint8), box.x, box.y)
    watch.lap("stereo")
    return StereoAnswer(nothing, nothing, (why,), watch.timings)
