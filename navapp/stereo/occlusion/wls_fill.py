"""Filling of occlusions by a weighted least squares fit, in the paper's directions.

In the left view an interior occlusion continues what stands on its left, a border occlusion what
stands on its right. A plane is fitted to matched pixels of that side: near the gap, of the
background's layer, of similar brightness, and confident. Only measured pixels speak, so no error is
carried along a gap and rows can be filled in any order.

Every other row is fitted, the sparser the further from what was measured; a row between two
fitted ones takes over what they say.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import run_both
from navapp.geometry.masks import where
from navapp.stereo.occlusion.classify import in_two_shares
from navapp.stereo.occlusion.wls_fill_kernels import fill_rows
from navapp.stereo.occlusion.wls_fit_kernels import (
    N_TOLD_OF_A_PLACE,
    Rules,
    Scene,
    Support,
    list_support,
)
from navapp.values import DisparityMap, Origin

_FILLED_SIGMA_PX = 5.0

# The wider the disparities spread, the wider the gaps, and the smaller a pixel's share of a part.
_RADIUS_PX, _RADIUS_PER_SPREAD, _RADIUS_LIMITS_PX = 10.0, 0.3, (16.0, 40.0)
_ROWS_PER_RADIUS, _DISTANCE_PER_RADIUS, _RADIUS_PER_STRIDE_PX = 0.3, 0.4, 13
_SPREAD_STEP = 3


@dataclass(frozen=True, slots=True)
class FillSettings:
    """How the fit works."""

    # columns of support beyond the gap; None: grows with the spread of disparities.
    radius_px: int | None = None
    # a pixel further from its permitted neighbour stays unknown; None: the width of the map.
    max_gap_px: int | None = None
    grey_scale: float = 6.0  # difference in grey levels at which a pixel's weight is 1/e
    layer_px: float = 3.0  # support differs from the permitted neighbour by less than this ...
    layer_growth: float = 0.15  # ... and this per px of distance
    # variance of the support's places at which half of the slope is believed; a slope is dangerous
    # far from where it was fitted.
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
        Filled pixels have their class as origin. What nothing may speak for is unknown.

    Raises:
        ValueError: sizes that differ.

    Source: the paper, section 3.2 (weighted least squares step for occlusions).
    """
    settings = settings or FillSettings()
    shape = left.disparity_px.shape
    if any(given.shape != shape for given in (picture, confidence, classes)):
        raise ValueError("picture (grey), confidence and classes need the map's size")
    scene = Scene(
        disparity=np.ascontiguousarray(left.disparity_px, dtype=np.float32),
        origin=np.ascontiguousarray(left.origin),
        classes=np.ascontiguousarray(classes),
        is_support=(left.origin == Origin.MATCHED) & (classes == 0),
        picture=np.ascontiguousarray(picture),
        confidence=np.ascontiguousarray(confidence, dtype=np.float32),
    )
    told = _fit_all(scene, settings)
    filled = where(~np.isnan(told), scene.classes, Origin.UNKNOWN)
    return told, where(scene.classes == 0, scene.origin, filled)


def support_radius_px(matched_px: NDArray[np.float32]) -> int:
    """Columns of support for matched disparities (N,) of this spread."""
    if not matched_px.size:
        return round(_RADIUS_LIMITS_PX[0])
    low, high = np.percentile(matched_px, [1.0, 99.0])
    radius = _RADIUS_PX + _RADIUS_PER_SPREAD * (high - low)
    return round(float(np.clip(radius, *_RADIUS_LIMITS_PX)))


def _fit_all(scene: Scene, settings: FillSettings) -> NDArray[np.float32]:
    """What the fits tell of the classified pixels; the matches elsewhere."""
    height, width = scene.disparity.shape
    rules = _rules(scene, settings)
    n_rows = -(-height // rules.stride)
    support = Support(
        np.empty((n_rows, width, N_TOLD_OF_A_PLACE), dtype=np.float32),
        np.empty((n_rows, width + 1), dtype=np.int32),
    )
    told = np.empty((height, width), dtype=np.float32)
    shared = (scene, support, rules)
    in_two_shares(lambda *rows: list_support(scene, rules.stride, *rows, support))
    # Even rows, then the odd ones between them.
    for first in (0, 1):
        run_both(
            partial(fill_rows, *shared, first, 4, told),
            partial(fill_rows, *shared, first + 2, 4, told),
        )
    return told


def _rules(scene: Scene, settings: FillSettings) -> Rules:
    radius = settings.radius_px
    if radius is None:
        # A part of the pixels tells the spread as well as all.
        part = np.s_[::_SPREAD_STEP, ::_SPREAD_STEP]
        radius = support_radius_px(scene.disparity[part][scene.is_support[part]])
    return Rules(
        radius=radius,
        rows=round(_ROWS_PER_RADIUS * radius),
        max_gap=scene.disparity.shape[1] if settings.max_gap_px is None else settings.max_gap_px,
        stride=max(2, round(radius / _RADIUS_PER_STRIDE_PX)),
        layer_px=np.float32(settings.layer_px),
        layer_growth=np.float32(settings.layer_growth),
        slope_penalty_px2=np.float32(settings.slope_penalty_px2),
        per_grey=np.float32(1.0 / settings.grey_scale),
        per_px=np.float32(1.0 / (_DISTANCE_PER_RADIUS * radius)),
    )
