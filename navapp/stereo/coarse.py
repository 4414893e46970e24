"""What lies where, to about a pixel: the coarse surface that the finer steps begin with.

Census and semi-global matching, at half resolution where that leaves enough of the picture: one
pixel of the half is the mean of four, pixel k lies at 2 k + 0.5 of the whole, and a disparity of
the whole is exactly twice that of the half.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.halves import double, half_box, inside_of_halves
from navapp.geometry.masks import where
from navapp.geometry.rectification import Image, RectifiedPair
from navapp.stereo.matching.census_sgm import CensusSettings, TwoViewDisparity, match_census
from navapp.stereo.matte_pictures import find_clipped
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
# What windows and the steps at the ends of a search ask for beside a box, at half resolution.
WINDOW_PX = 8
# Half the census window of a map at half resolution, in pixels of the whole.
_CLIPPED_REACH_PX = 2 * SURFACE_CENSUS.radius_x


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
    found = match_census(pair, band_px, SURFACE_CENSUS)
    evidence = Evidence(found.right_px, found.right_x0, found.confidence)
    return CoarseSurface(smooth_steps(found.left.disparity_px), evidence, found.agreement)


def _coarse_at_half(pair: RectifiedPair, band_px: tuple[float, float]) -> CoarseSurface:
    low, high = band_px
    found = match_census(halve(pair, band_px), (low / 2.0, high / 2.0), SURFACE_CENSUS)
    surface_px = double_disparity(smooth_steps(found.left.disparity_px), pair.box)
    right = replace(pair.box, x=2 * found.right_x0, width=2 * found.right_px.shape[1])
    right_px = np.float32(2.0) * double(found.right_px, right)
    evidence = Evidence(right_px, right.x, double(found.confidence, pair.box))
    return CoarseSurface(surface_px, evidence, found.agreement)


@dataclass(frozen=True, slots=True, eq=False)
class CoarseMatch:
    """The matches behind a coarse map, at the resolution they were made in."""

    pair: RectifiedPair
    is_half: bool  # halved from the pictures
    found: TwoViewDisparity
    band_px: tuple[float, float]  # disparities that were searched, at that resolution


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
    is_half = _is_wide(pair, band_px)
    small = halve(pair, band_px) if is_half else pair
    if is_half:
        band_px = band_px[0] / 2.0, band_px[1] / 2.0
    found = match_census(small, band_px, SURFACE_CENSUS)
    if not found.agreement >= LEAST_AGREEMENT:
        unknown = np.full((pair.box.height, pair.box.width), np.nan, dtype=np.float32)
        return CoarseMap(unknown, pair.box)
    surface_px = calm(found.left.disparity_px)
    surface_px = double_disparity(surface_px, pair.box) if is_half else surface_px
    return CoarseMap(surface_px, pair.box, CoarseMatch(small, is_half, found, band_px))


def find_near_clipped(pair: RectifiedPair) -> NDArray[np.bool_]:
    """(h, w) pixels of the pair's box whose coarse disparity may come from clipped pixels.

    A lamp that is reflected in a convex wet surface has its image behind the surface, and is
    matched there. Clipped pixels outside the box are not looked at.

    Args:
        pair: rectified grey pictures; the box lies in them.
    """
    import cv2

    is_clipped = find_clipped(pair.left[pair.box.slices]).astype(np.uint8)
    size = 2 * _CLIPPED_REACH_PX + 1
    return np.asarray(cv2.dilate(is_clipped, np.ones((size, size), np.uint8)) > 0)


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
    if coarse_surface(clip_box(given), band_px).agreement >= LEAST_AGREEMENT:
        return False
    return coarse_surface(clip_box(exchanged), band_px).agreement >= _MOST_AGREE


def clip_box(pair: RectifiedPair) -> RectifiedPair:
    """The pair with the part of its box that lies in the pictures."""
    height, width = pair.left.shape[:2]
    return replace(pair, box=pair.box.clip(width, height))


def smooth_steps(coarse_px: NDArray[np.float32]) -> NDArray[np.float32]:
    """A matched map (h, w) of whole disparities as a smooth surface, single holes closed."""
    import cv2

    known = np.isfinite(coarse_px)
    weights = known.astype(np.float32)
    surface = regional_support(coarse_px, weights, coarse_px.shape, _COARSE_SURFACE)
    around = cv2.dilate(known.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
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
    around = cv2.dilate(known.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    with np.errstate(invalid="ignore"):
        is_off = np.abs(mean - coarse_px) > _COARSE_STEP_PX
    cv2.copyTo(coarse_px, is_off.view(np.uint8), mean)
    return where(around, mean, np.float32(np.nan))


def halve(pair: RectifiedPair, band_px: tuple[float, float] | None = None) -> RectifiedPair:
    """The pair at half its resolution; an odd last row or column is left out.

    Args:
        pair: rectified grey pictures.
        band_px: smallest and largest disparity. With it only the pair's box, and what it reaches in
            the right picture, is made; the rest is 0.
    """
    height, width = (length // 2 for length in pair.left.shape)
    half, whole = half_box(pair.box), Box(0, 0, width, height)
    in_left = in_right = whole
    if band_px is not None:
        in_left = half.grow(WINDOW_PX)
        # From the farthest partner of the first column to the nearest of the last.
        farthest, nearest = math.ceil(band_px[1] / 2.0), math.floor(band_px[0] / 2.0)
        first, after = in_left.x - farthest, in_left.x + in_left.width - nearest
        in_right = replace(in_left, x=first, width=max(after - first, 0))
    return RectifiedPair(
        _halve(pair.left, in_left.clip(width, height), whole),
        _halve(pair.right, in_right.clip(width, height), whole),
        pair.geometry.reduced(2),
        half,
    )


def _halve(image: Image, part: Box, whole: Box) -> Image:
    """A part (of the half) of a picture at half its resolution; 0 elsewhere."""
    import cv2

    small = np.zeros((whole.height, whole.width), dtype=np.uint8)
    if not part.is_empty:
        rows, columns = (
            slice(part.y, part.y + part.height), slice(part.x, part.x + part.width)
        )  # fmt: skip
        even = image[2 * rows.start : 2 * rows.stop, 2 * columns.start : 2 * columns.stop]
        size = (part.width, part.height)
        cv2.resize(even, size, dst=small[rows, columns], interpolation=cv2.INTER_AREA)
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
