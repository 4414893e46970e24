"""Filling of occlusions by a weighted least squares fit, in the paper's directions.

In the left view an interior occlusion continues what stands on its left, a border occlusion what
stands on its right. A plane is fitted to matched pixels of that side: near the gap, of the
background's layer, of similar colour, and confident. Only measured pixels speak, so the rows are
independent and no error is carried along a gap.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.stereo.bands import in_row_bands
from navapp.stereo.occlusion import as_three_channels
from navapp.stereo.wls_fill_kernels import BOTH, LEFT, RIGHT, calm_rows, fill_rows
from navapp.values import DisparityMap, Origin

_FILLED_SIGMA_PX = 5.0
_N_COLOUR_STEPS = 3 * 255 + 1
# Even a match without confidence tells something.
_LEAST_TRUST = 0.05

# The wider the disparities spread, the wider the gaps, and the smaller a pixel's share of a part.
_RADIUS_PX, _RADIUS_PER_SPREAD, _RADIUS_LIMITS_PX = 10.0, 0.3, (16.0, 40.0)
_ROWS_PER_RADIUS, _DISTANCE_PER_RADIUS, _RADIUS_PER_STRIDE_PX = 0.3, 0.4, 13

_SIDES = np.zeros(256, dtype=np.uint8)
_SIDES[Origin.FILLED_BORDER] = RIGHT
_SIDES[Origin.FILLED_INTERIOR] = LEFT
_SIDES[Origin.MISMATCH_FILLED] = BOTH


@dataclass(frozen=True, slots=True)
class FillSettings:
    """How the fit works.

    Attributes:
        radius_px: columns of support beyond the gap; None: grows with the spread of disparities.
        max_gap_px: a pixel further from its permitted neighbour stays unknown; None: the width of
            the map.
        colour_scale: sum of the three colour differences at which a pixel's weight is 1/e.
        layer_px: support differs from the permitted neighbour by less than this,
        layer_growth: and by this more per px of distance.
        slope_penalty_px2: variance of the support's places at which half of the slope is believed;
            a slope is dangerous far from where it was fitted.
    """

    radius_px: int | None = None
    max_gap_px: int | None = None
    colour_scale: float = 18.0
    layer_px: float = 3.0
    layer_growth: float = 0.15
    slope_penalty_px2: float = 20.0


def fill_wls(
    left: DisparityMap,
    picture: NDArray[np.uint8],
    confidence: NDArray[np.float32],
    classes: NDArray[np.uint8],
    settings: FillSettings | None = None,
) -> DisparityMap:
    """The map with its classified pixels filled; every other pixel keeps all its bits.

    Args:
        left: of the left view, or a mirrored one of the right view (`occlusion.mirrored`).
        picture: (h, w) or (h, w, 3) rectified picture over the map.
        confidence: (h, w) float32, 0 to 1, of the matches.
        classes: (h, w) of `occlusion.classify`.
        settings: of the fit.

    Returns:
        Filled pixels have their class as origin and a large sigma: they make a picture whole, they
        measure nothing. What nothing may speak for is unknown.

    Raises:
        ValueError: sizes that differ.

    Source: the paper, section 3.2 (weighted least squares step for occlusions).
    """
    settings = settings or FillSettings()
    shape = left.disparity_px.shape
    if confidence.shape != shape or classes.shape != shape:
        raise ValueError("confidence and classes need the map's size")
    colours = as_three_channels(picture, left)
    sides = _SIDES[classes]
    is_support = (left.origin == Origin.MATCHED) & (sides == 0)
    told = np.full((3, *shape), np.nan, dtype=np.float32)
    if is_support.any() and sides.any():
        _fit_everywhere(left.disparity_px, is_support, colours, confidence, sides, settings, told)
    disparity = np.where(sides > 0, told[0], left.disparity_px)
    calmed = disparity.copy()
    in_row_bands(
        shape[0],
        lambda first, last: calm_rows(disparity, told, sides, first, last, calmed),
    )
    is_filled = (sides > 0) & np.isfinite(calmed)
    sigma = np.where(sides > 0, np.float32(np.nan), left.sigma_px)
    origin = np.where(sides > 0, np.uint8(Origin.UNKNOWN), left.origin)
    sigma[is_filled] = _FILLED_SIGMA_PX
    origin[is_filled] = classes[is_filled]
    return DisparityMap(calmed, sigma, origin, left.x, left.y)


def support_radius_px(matched_px: NDArray[np.float32]) -> int:
    """Columns of support for matched disparities (N,) of this spread."""
    # Every seventh tells the spread as well as all.
    low, high = np.percentile(matched_px[::7], [1.0, 99.0])
    radius = _RADIUS_PX + _RADIUS_PER_SPREAD * (high - low)
    return round(float(np.clip(radius, *_RADIUS_LIMITS_PX)))


def _fit_everywhere(
    disparity: NDArray[np.float32],
    is_support: NDArray[np.bool_],
    colours: NDArray[np.int16],
    confidence: NDArray[np.float32],
    sides: NDArray[np.uint8],
    settings: FillSettings,
    told: NDArray[np.float32],
) -> None:
    height, width = disparity.shape
    radius = settings.radius_px
    if radius is None:
        radius = support_radius_px(disparity[is_support])
    max_gap = width if settings.max_gap_px is None else settings.max_gap_px
    numbers = np.array(
        [
            radius,
            max_gap,
            settings.layer_px,
            settings.layer_growth,
            settings.slope_penalty_px2,
            max(2, round(radius / _RADIUS_PER_STRIDE_PX)),
        ]
    )
    rows, columns = np.mgrid[: round(_ROWS_PER_RADIUS * radius) + 1, :width]
    distance = np.hypot(rows, columns) / (_DISTANCE_PER_RADIUS * radius)
    # Beyond this all weights of a pixel could vanish together; they are only compared.
    distance_weight = np.exp(-np.minimum(distance, 60.0)).astype(np.float32)
    colour_weight = np.exp(-np.arange(_N_COLOUR_STEPS) / settings.colour_scale).astype(np.float32)
    trust = (np.nan_to_num(confidence) + _LEAST_TRUST).astype(np.float32)
    values = np.ascontiguousarray(disparity, dtype=np.float32)
    in_row_bands(
        height,
        lambda first, last: fill_rows(
            values, is_support, colours, trust, sides, colour_weight, distance_weight, numbers,
            first, last, told,
        ),
    )  # fmt: skip
