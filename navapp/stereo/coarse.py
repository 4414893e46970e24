"""What lies where, to about a pixel: the coarse surface that the finer steps of a chain begin with.

Census and semi-global matching, at half resolution where that leaves enough of the picture.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.matching.census_sgm import CensusSettings, match_census
from navapp.stereo.subpixel.coarse_to_fine import calmed, without_steps
from navapp.stereo.subpixel.half_resolution import doubled, doubled_disparity, halved

# Below this share of left-right agreement the two pictures do not show the same scene that way
# round: with left and right swapped a few per cent agree by chance, otherwise far more than half.
LEAST_AGREEMENT, _MOST_AGREE = 0.15, 0.5
# At half resolution a larger window holds two sides of a crest or a rim.
_SURFACE_CENSUS = CensusSettings(radius_x=3, radius_y=2, p1=5, p2=30)
# So few are soon matched as they are; at half resolution too little of the picture is left.
_FEW_CELLS = 3_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What the fill asks besides the left map, at full resolution: the other view, and trust."""

    right_px: NDArray[np.float32]
    right_x0: int
    confidence: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class CoarseSurface:
    """A matched surface without steps, at full resolution, and what else the matcher saw."""

    surface_px: NDArray[np.float32]
    evidence: Evidence
    agreement: float


def coarse_surface(pair: RectifiedPair, band_px: tuple[float, float]) -> CoarseSurface:
    """Of the part of `pair.box` inside the pictures.

    Args:
        pair: rectified grey pictures, clipped.
        band_px: smallest and largest disparity expected.
    """
    return (_coarse_at_half if _is_wide(pair, band_px) else _coarse_at_full)(pair, band_px)


def _is_wide(pair: RectifiedPair, band_px: tuple[float, float]) -> bool:
    return pair.box.width * pair.box.height * (band_px[1] - band_px[0]) > _FEW_CELLS


def _coarse_at_full(pair: RectifiedPair, band_px: tuple[float, float]) -> CoarseSurface:
    found = match_census(pair, band_px, _SURFACE_CENSUS)
    evidence = Evidence(found.right_px, found.right_x0, found.confidence)
    return CoarseSurface(without_steps(found.left.disparity_px), evidence, found.agreement)


def _coarse_at_half(pair: RectifiedPair, band_px: tuple[float, float]) -> CoarseSurface:
    low, high = band_px
    found = match_census(halved(pair, band_px), (low / 2.0, high / 2.0), _SURFACE_CENSUS)
    surface_px = doubled_disparity(without_steps(found.left.disparity_px), pair.box)
    right = replace(pair.box, x=2 * found.right_x0, width=2 * found.right_px.shape[1])
    right_px = np.float32(2.0) * doubled(found.right_px, right)
    evidence = Evidence(right_px, right.x, doubled(found.confidence, pair.box))
    return CoarseSurface(surface_px, evidence, found.agreement)


def match_coarsely(pair: RectifiedPair, band_px: tuple[float, float]) -> NDArray[np.float32]:
    """What lies where, to about a pixel: for what hides a surface, not for measuring it.

    Args:
        pair: rectified grey pictures; the part of `pair.box` inside them is matched.
        band_px: smallest and largest disparity expected.

    Returns:
        (h, w) disparity over the part of `pair.box` inside the pictures, NaN where unknown; all
        unknown when the pictures hardly agree.
    """
    pair = clipped(pair)
    is_half = _is_wide(pair, band_px)
    small = halved(pair, band_px) if is_half else pair
    band_px = (band_px[0] / 2.0, band_px[1] / 2.0) if is_half else band_px
    found = match_census(small, band_px, _SURFACE_CENSUS)
    if not found.agreement >= LEAST_AGREEMENT:
        return np.full((pair.box.height, pair.box.width), np.nan, dtype=np.float32)
    surface_px = calmed(found.left.disparity_px)
    return doubled_disparity(surface_px, pair.box) if is_half else surface_px


def are_swapped(
    given: RectifiedPair, band_px: tuple[float, float], exchanged: RectifiedPair
) -> bool:
    """Whether two pictures show one scene the other way round only.

    Exchanged, disparities have the other sign: the band that holds the scene holds nothing.

    Args:
        given: as the pictures came.
        band_px: smallest and largest disparity of the scene around the box.
        exchanged: the same, left called right before they were rectified.
    """
    if coarse_surface(clipped(given), band_px).agreement >= LEAST_AGREEMENT:
        return False
    return coarse_surface(clipped(exchanged), band_px).agreement >= _MOST_AGREE


def clipped(pair: RectifiedPair) -> RectifiedPair:
    """The pair with the part of its box that lies in the pictures."""
    height, width = pair.left.shape[:2]
    return replace(pair, box=pair.box.clipped(width, height))
