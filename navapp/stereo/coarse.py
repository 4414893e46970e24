"""What lies where, to about a pixel: the coarse surface that the finer steps begin with.

Census and semi-global matching, at half resolution where that leaves enough of the picture: one
pixel of the half is the mean of four, pixel k lies at 2 k + 0.5 of the whole, and a disparity of
the whole is exactly twice that of the half.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.halves import double, half_box, inside_of_halves, mean_blocks
from navapp.geometry.masks import grow, where
from navapp.geometry.rectification import Image, RectifiedPair, find_reached
from navapp.geometry.resampling import TAPS_PX
from navapp.stereo.matching.census_sgm import (
    CensusSettings,
    FillEvidence,
    TwoViewDisparity,
    match_census,
)
from navapp.stereo.subpixel.regional import RegionalSettings, regional_support

# Below this share of left-right agreement the two pictures do not show the same scene that way
# round: with left and right swapped a few per cent agree by chance, otherwise far more than half.
LEAST_AGREEMENT, _MOST_AGREE = 0.15, 0.5
# At half resolution a larger window holds two sides of a crest or a rim.
SURFACE_CENSUS = CensusSettings(radius_x=3, radius_y=2, p1=5, p2=30)
# So few are soon matched as they are; at half resolution too little of the picture is left.
_FEW_CELLS = 3_000_000
_COARSE_SURFACE = RegionalSettings(radius_px=8, node_px=4, thin=1, scales_px=(1.5, 0.75, 0.4))
# Neighbours over which a map is averaged that only has to tell what lies where.
_CALM_PX = 5
_COARSE_STEP_PX = 0.5
_FAR_FROM_MATCH_PX = 1.5
# Half the census window of a map at half resolution, in pixels of the whole.
CLIPPED_REACH_PX = 2 * SURFACE_CENSUS.radius_x


@dataclass(frozen=True, slots=True, eq=False)
class CoarseMatch:
    """Matches to about a pixel, at the resolution they were made in."""

    pair: RectifiedPair
    is_half: bool  # halved from the pictures
    found: TwoViewDisparity
    band_px: tuple[float, float]  # disparities that were searched, at that resolution

    @classmethod
    def of(cls, pair: RectifiedPair, band_px: tuple[float, float]) -> "CoarseMatch":
        """Match a pair, at half its resolution where that leaves enough of the picture.

        Args:
            pair: rectified grey pictures, its box in them.
            band_px: smallest and largest disparity expected.
        """
        is_half = pair.box.width * pair.box.height * (band_px[1] - band_px[0]) > _FEW_CELLS
        if is_half:
            band_px = band_px[0] / 2.0, band_px[1] / 2.0
            pair = halve(pair, band_px)
        return cls(pair, is_half, match_census(pair, band_px, SURFACE_CENSUS), band_px)

    def at_full(self, surface_px: NDArray[np.float32], box: Box) -> NDArray[np.float32]:
        """A surface of these matches at full resolution, over the box that was asked for."""
        return double_disparity(surface_px, box) if self.is_half else surface_px

    def fill_evidence(self, box: Box) -> FillEvidence:
        """What a fill at full resolution asks, over the box that was asked for."""
        found = self.found
        if not self.is_half:
            return found
        right = replace(box, x=2 * found.right_x0, width=2 * found.right_px.shape[1])
        right_px = np.float32(2.0) * double(found.right_px, right)
        return FillEvidence(right_px, right.x, double(found.confidence, box))


@dataclass(frozen=True, slots=True, eq=False)
class CoarseMap:
    """What lies where in a box, to about a pixel: to tell what hides a surface, not to measure."""

    disparity_px: NDArray[np.float32]  # (h, w) over the box, calm, NaN where unknown
    box: Box  # of the rectified left view
    matched: CoarseMatch | None = None  # what it was made of; None when the pictures disagree

    def over(self, box: Box) -> NDArray[np.float32] | None:
        """(h, w) of a box inside this one; None when it reaches beyond."""
        row, column = box.y - self.box.y, box.x - self.box.x
        part = self.disparity_px[max(row, 0) :, max(column, 0) :][: box.height, : box.width]
        return part if min(row, column) >= 0 and part.shape == (box.height, box.width) else None


def match_coarsely(pair: RectifiedPair, band_px: tuple[float, float]) -> CoarseMap:
    """What lies where, to about a pixel; all is unknown when the pictures hardly agree.

    Args:
        pair: rectified grey pictures; the part of `pair.box` inside them is matched.
        band_px: smallest and largest disparity expected.
    """
    pair = clip_box(pair)
    matched = CoarseMatch.of(pair, band_px)
    if not matched.found.agreement >= LEAST_AGREEMENT:
        unknown = np.full((pair.box.height, pair.box.width), np.nan, dtype=np.float32)
        return CoarseMap(unknown, pair.box)
    surface_px = matched.at_full(calm(matched.found.left.disparity_px), pair.box)
    return CoarseMap(surface_px, pair.box, matched)


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
    if CoarseMatch.of(clip_box(given), band_px).found.agreement >= LEAST_AGREEMENT:
        return False
    return CoarseMatch.of(clip_box(exchanged), band_px).found.agreement >= _MOST_AGREE


def clip_box(pair: RectifiedPair) -> RectifiedPair:
    """The pair with the part of its box that lies in the pictures."""
    height, width = pair.left.shape[:2]
    return replace(pair, box=pair.box.clip(width, height))


def smooth_steps(coarse_px: NDArray[np.float32]) -> NDArray[np.float32]:
    """A matched map (h, w) of whole disparities as a smooth surface, single holes closed."""
    known = np.isfinite(coarse_px)
    weights = known.astype(np.float32)
    surface = regional_support(coarse_px, weights, coarse_px.shape, _COARSE_SURFACE)
    around = grow(known, 1)
    with np.errstate(invalid="ignore"):
        is_same = np.abs(surface - coarse_px) < _FAR_FROM_MATCH_PX
    smooth = np.where(known & ~is_same, coarse_px, surface)
    return np.where(around, smooth, np.float32(np.nan)).astype(np.float32)


def calm(coarse_px: NDArray[np.float32]) -> NDArray[np.float32]:
    """A matched map (h, w) with less noise, single holes closed: to tell what lies where.

    A pixel whose neighbourhood is off by more than a step of the map keeps what it has: edges keep
    their place.
    """
    import cv2

    known = np.isfinite(coarse_px)
    counts = known.astype(np.float32)
    window = (_CALM_PX, _CALM_PX)
    filled = cv2.patchNaNs(coarse_px.copy(), 0.0)
    total = cv2.boxFilter(filled, -1, window, normalize=False)
    mean = total / np.maximum(cv2.boxFilter(counts, -1, window, normalize=False), np.float32(1.0))
    around = grow(known, 1)
    with np.errstate(invalid="ignore"):
        is_off = np.abs(mean - coarse_px) > _COARSE_STEP_PX
    cv2.copyTo(coarse_px, is_off.view(np.uint8), mean)
    return where(around, mean, np.float32(np.nan))


def halve(pair: RectifiedPair, band_px: tuple[float, float]) -> RectifiedPair:
    """The pair at half its resolution; an odd last row or column is left out.

    Args:
        pair: rectified grey pictures.
        band_px: smallest and largest disparity, in pixels of the half. Only the pair's box, and
            what it reaches in the right picture, is made; the rest is 0.
    """
    half = half_box(pair.box)
    # Windows and the steps at the ends of a search ask for no more than interpolation does.
    in_left, in_right = find_reached(half.grow(TAPS_PX), band_px)
    left, right = _halve(pair.left, in_left), _halve(pair.right, in_right)
    return RectifiedPair(left, right, pair.geometry.reduced(2), half)


def _halve(image: Image, part: Box) -> Image:
    """A part (of the half) of a picture at half its resolution; 0 elsewhere."""
    small = np.zeros([length // 2 for length in image.shape], dtype=np.uint8)
    part = part.clip(small.shape[1], small.shape[0])
    if not part.is_empty:
        covered = Box(2 * part.x, 2 * part.y, 2 * part.width, 2 * part.height)
        small[part.slices] = mean_blocks(image[covered.slices], 2)
    return small


def double_disparity(half_px: NDArray[np.float32], box: Box) -> NDArray[np.float32]:
    """(h, w) disparity over a box of the whole, from that over `half_box(box)`; interpolated.

    A pixel whose half pixel is known is known: unknown neighbours do not spread.
    """
    import cv2

    height, width = half_px.shape
    # OpenCV's enlargement puts the half's pixel k at 2 k + 0.5, as it should be.
    between = cv2.resize(half_px, (2 * width, 2 * height), interpolation=cv2.INTER_LINEAR)
    between = between[inside_of_halves(box)]
    finest = double(half_px, box)
    cv2.copyTo(between, np.isfinite(between).view(np.uint8), finest)
    return np.asarray(np.float32(2.0) * finest, dtype=np.float32)
