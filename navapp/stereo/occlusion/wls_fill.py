"""Filling of occlusions by a weighted least squares fit, in the paper's directions.

In the left view an interior occlusion continues what stands on its left, a border occlusion what
stands on its right, a mismatch what stands on both. A plane is fitted to matched pixels of that
side: near the gap, of the background's layer, of similar brightness, and confident. Only measured
pixels take part, so no error is carried along a gap and rows can be filled in any order. Each row
of a gap is filled in pieces, which end after 16 px or where the picture's brightness changes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_two_shares
from navapp.geometry.masks import where
from navapp.stereo.occlusion.wls_fill_kernels import STRIDE_PX, Rules, Scene, fill_rows
from navapp.values import DisparityMap, Origin

_FILLED_SIGMA_PX = 5.0

# The wider the disparities spread, the wider the gaps, and the smaller a pixel's share of a part.
_RADIUS_PX, _RADIUS_PER_SPREAD, _RADIUS_LIMITS_PX = 10.0, 0.3, (16.0, 40.0)
_ROWS_PER_RADIUS, _DISTANCE_PER_RADIUS = 0.3, 0.4
_SPREAD_STEP = 3


@dataclass(frozen=True, slots=True)
class FillSettings:
    """How the fit works."""

    # how far support reaches beyond the gap; None: the further, the wider disparities spread.
    radius_px: int | None = None
    # a pixel further from its permitted neighbour stays unknown; None: the width of the map.
    max_gap_px: int | None = None
    grey_scale: float = 6.0  # difference in grey levels at which a pixel's weight is 1/e
    layer_px: float = 3.0  # support differs from the permitted neighbour by less than this ...
    layer_growth: float = 0.15  # ... and this per px of distance
    # variance of the support's places at which half of the slope is believed, above 0: a slope is
    # dangerous far from where it was fitted.
    slope_penalty_px2: float = 20.0


def fill_wls(
    left: DisparityMap,
    picture: NDArray[np.uint8],
    confidence: NDArray[np.float32],
    classes: NDArray[np.uint8],
    settings: FillSettings | None = None,
) -> DisparityMap:
    """The map with its classified pixels filled, as of `fill_gaps`.

    Filled pixels have a large sigma: they make a picture whole, they measure nothing.
    """
    disparity, origin = fill_gaps(left, picture, confidence, classes, settings)
    sigma = where(classes == 0, left.sigma_px, _FILLED_SIGMA_PX)
    sigma = where(origin != Origin.UNKNOWN, sigma, np.nan)
    return DisparityMap(disparity, sigma, origin, left.x, left.y)


def fill_gaps(
    left: DisparityMap,
    picture: NDArray[np.uint8],
    confidence: NDArray[np.float32],
    classes: NDArray[np.uint8],
    settings: FillSettings | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Disparity and origin (h, w) with classified pixels filled; the others keep all their bits.

    Args:
        left: of the left view.
        picture: (h, w) rectified grey picture over the map.
        confidence: (h, w) float32, 0 to 1, of the matches.
        classes: (h, w) of `occlusion.classify`.
        settings: of the fit.

    Returns:
        Filled pixels have their class as origin. What no match may fill is unknown.

    Raises:
        ValueError: sizes that differ.

    Source: the paper, section 3.2 (weighted least squares step for occlusions).
    """
    shape = left.disparity_px.shape
    if any(given.shape != shape for given in (picture, confidence, classes)):
        raise ValueError("picture (grey), confidence and classes need the map's size")
    scene = Scene(
        disparity=np.ascontiguousarray(left.disparity_px, dtype=np.float32),
        classes=np.ascontiguousarray(classes),
        is_support=(left.origin == Origin.MATCHED) & (classes == 0),
        picture=np.ascontiguousarray(picture),
        confidence=np.ascontiguousarray(confidence, dtype=np.float32),
    )
    rules = _make_rules(scene, settings or FillSettings())
    told = where(classes == 0, scene.disparity, np.nan)
    in_two_shares(lambda *rows: fill_rows(scene, rules, *rows, told))
    filled = where(~np.isnan(told), scene.classes, Origin.UNKNOWN)
    return told, where(classes == 0, left.origin, filled)


def support_radius_px(matched_px: NDArray[np.float32]) -> int:
    """Columns of support for matched disparities (N,) of this spread."""
    if not matched_px.size:
        return round(_RADIUS_LIMITS_PX[0])
    low, high = np.percentile(matched_px, [1.0, 99.0])
    radius = _RADIUS_PX + _RADIUS_PER_SPREAD * (high - low)
    return round(float(np.clip(radius, *_RADIUS_LIMITS_PX)))


def _make_rules(scene: Scene, settings: FillSettings) -> Rules:
    radius = settings.radius_px
    if radius is None:
        # A part of the pixels tells the spread as well as all.
        part = np.s_[::_SPREAD_STEP, ::_SPREAD_STEP]
        radius = support_radius_px(scene.disparity[part][scene.is_support[part]])
    return Rules(
        radius_px=radius,
        n_rows=max(round(_ROWS_PER_RADIUS * radius) // STRIDE_PX, 1),
        max_gap_px=scene.disparity.shape[1] if settings.max_gap_px is None else settings.max_gap_px,
        distance_px=_DISTANCE_PER_RADIUS * radius,
        grey_scale=settings.grey_scale,
        layer_px=settings.layer_px,
        layer_growth=settings.layer_growth,
        slope_penalty_px2=settings.slope_penalty_px2,
    )
