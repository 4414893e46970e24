"""Disparity of both views without a pose: census distances, semi-global aggregation.

Sub-pixel places come from a parabola through whole disparities, which leans towards whole pixels:
good as a support, to be refined for geometry.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Box, Image, RectifiedPair
from navapp.stereo.bands import in_row_bands, run_both
from navapp.stereo.census_kernels import census_rows
from navapp.stereo.consistency import (
    agreement_share,
    at_partner,
    speckle_free,
    view_difference_px,
)
from navapp.stereo.search import Search, contrast_grey, crop, plan_search
from navapp.stereo.sgm_kernels import aggregate_scan, choose_rows
from navapp.values import DisparityMap, Origin

_MAX_VOLUME_BYTES = 3 * 1024**3
# Two scans, two bytes each.
_BYTES_PER_CELL = 4
_MAX_PENALTY = 4000
_MAX_CODE_BITS = 64


@dataclass(frozen=True, slots=True)
class CensusSettings:
    """How the matcher works.

    Attributes:
        radius_x, radius_y: of the census window, px; at most 65 pixels in it.
        p1: penalty of a step of one disparity between neighbours.
        p2: penalty of a larger step, divided by 1 + (grey step) / `edge_grey`.
        edge_grey: grey step that halves `p2`.
        max_difference_px: between the two views, and between neighbours of one patch.
        min_uniqueness: how much worse than the best, as a share of it, the best disparity that is
            no neighbour must be.
        speckle_px: smaller patches of similar disparity are removed.
        contrast_grey: a window with a smaller range of grey levels (no light, glare) matches
            everything, so it matches nothing.
        full_contrast_grey: range of grey levels from which texture no longer lowers the confidence.
        sigma_px: standard deviation that is claimed for every match.
    """

    radius_x: int = 2
    radius_y: int = 2
    p1: int = 6
    p2: int = 40
    edge_grey: int = 8
    max_difference_px: float = 1.0
    min_uniqueness: float = 0.05
    speckle_px: int = 60
    contrast_grey: int = 3
    full_contrast_grey: int = 16
    sigma_px: float = 0.2

    def __post_init__(self) -> None:
        if min(self.radius_x, self.radius_y) < 0 or not 0 < self.code_bits <= _MAX_CODE_BITS:
            raise ValueError(f"a census window needs 2 to {_MAX_CODE_BITS + 1} pixels")
        if not 0 < self.p1 < self.p2 <= _MAX_PENALTY or self.edge_grey < 1:
            raise ValueError(f"penalties must be 0 < p1 < p2 <= {_MAX_PENALTY}, edge_grey >= 1")

    @property
    def code_bits(self) -> int:
        """Neighbours in the window."""
        return (2 * self.radius_x + 1) * (2 * self.radius_y + 1) - 1


@dataclass(frozen=True, slots=True, eq=False)
class TwoViewDisparity:
    """What one aggregated cost says about both views.

    Attributes:
        left: over the pair's box; only consistent pixels are matched, nothing is filled.
        right_px: (h, W) float32 disparity of the right view, whole pixels, NaN unknown; rows of the
            box. Unchecked: what the right view prefers among the box's pixels.
        right_x0: right column of `right_px`'s first column.
        confidence: (h, w) float32, 0 to 1, from uniqueness, texture and the agreement of the views;
            0 where unmatched.
        agreement: share of the pixels with contrast that are matched; tiny when the pictures are
            exchanged, NaN when no pixel of either view has contrast.
    """

    left: DisparityMap
    right_px: NDArray[np.float32]
    right_x0: int
    confidence: NDArray[np.float32]
    agreement: float


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """One picture's crop as the matcher sees it: all (h, w)."""

    grey: Image
    codes: NDArray[np.uint64]
    contrast_grey: NDArray[np.uint8]


def match_census(
    pair: RectifiedPair, band_px: tuple[float, float], settings: CensusSettings | None = None
) -> TwoViewDisparity:
    """Match the box of a rectified pair within a band of disparities.

    Args:
        pair: rectified grey pictures; `pair.box` is matched and may reach beyond them.
        band_px: smallest and largest disparity expected.
        settings: of the matcher.

    Raises:
        ValueError: pictures that are not grey or differ in size, a band that is none or of more
            than 1024 disparities, a cost volume of more than 3 GiB.

    Source: census transform, Zabih and Woodfill 1994; aggregation along eight paths, Hirschmueller
    2008.
    """
    settings = settings or CensusSettings()
    search = plan_search(pair, band_px)
    _check_volume(search)
    if search.is_empty:
        return _nothing(search)
    left = _view(pair.left, search.inside, settings)
    right = _view(pair.right, search.right, settings)
    left_px, right_px, uniqueness = _aggregate_and_choose(left, right, search, settings)
    partner_contrast = at_partner(right.contrast_grey, left_px, search.shift, np.uint8(0))
    least_contrast = np.minimum(left.contrast_grey, partner_contrast)
    is_judged = least_contrast >= settings.contrast_grey
    difference = view_difference_px(left_px, right_px, search.shift)
    is_matched = is_judged & (difference <= settings.max_difference_px)
    is_matched &= uniqueness >= settings.min_uniqueness
    is_matched = speckle_free(
        np.where(is_matched, left_px, np.float32(np.nan)),
        settings.speckle_px,
        settings.max_difference_px,
    )
    # Smooth paths agree by chance too, but in specks.
    agreement = agreement_share(is_matched, is_judged)
    texture = np.minimum(least_contrast / np.float32(settings.full_contrast_grey), 1.0)
    # Views that differ by all that is allowed keep half of the confidence.
    closeness = 1.0 - 0.5 * np.nan_to_num(difference) / settings.max_difference_px
    confidence = np.where(is_matched, uniqueness * texture * closeness, 0.0).astype(np.float32)
    return _result(
        search, settings, np.where(is_matched, left_px, np.nan), right_px, confidence, agreement
    )


def _check_volume(search: Search) -> None:
    cells = search.inside.width * search.inside.height * search.count
    if cells * _BYTES_PER_CELL > _MAX_VOLUME_BYTES:
        raise ValueError(
            f"a box of {search.inside.width}x{search.inside.height} px with {search.count} "
            f"disparities needs {cells * _BYTES_PER_CELL / 1024**3:.1f} GiB, at most "
            f"{_MAX_VOLUME_BYTES // 1024**3} are used: take a smaller box or band"
        )


def _view(image: Image, box: Box, settings: CensusSettings) -> _View:
    radius = (settings.radius_x, settings.radius_y)
    grown = crop(image, box, radius)
    codes = np.empty((box.height, box.width), dtype=np.uint64)
    census_rows(grown, *radius, 0, box.height, codes)
    return _View(crop(image, box, (0, 0)), codes, contrast_grey(grown, radius))


def _aggregate_and_choose(
    left: _View, right: _View, search: Search, settings: CensusSettings
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Disparity of the left and of the right view, uniqueness of the left."""
    height, width = left.grey.shape
    # Neither cheap nor dear: the path decides about a pixel whose partner is outside.
    no_partner = settings.code_bits // 2
    penalties = (
        np.int16(settings.p1), np.int16(settings.p2), np.int16(no_partner), settings.edge_grey
    )  # fmt: skip
    first_partner = search.shift - search.lowest
    totals = [np.zeros((height, width, search.count), dtype=np.int16) for _ in range(2)]

    def scan(is_backward: bool) -> None:
        total = totals[int(is_backward)]
        aggregate_scan(
            left.codes, right.codes, left.grey, first_partner, penalties, is_backward, total
        )

    run_both(lambda: scan(False), lambda: scan(True))
    left_px = np.empty((height, width), dtype=np.float32)
    right_px = np.empty(right.grey.shape, dtype=np.float32)
    uniqueness = np.empty((height, width), dtype=np.float32)
    in_row_bands(
        height,
        lambda first, last: choose_rows(
            totals[0], totals[1], first_partner, search.lowest, (first, last),
            left_px, right_px, uniqueness,
        ),
    )  # fmt: skip
    return left_px, right_px, uniqueness


def _nothing(search: Search) -> TwoViewDisparity:
    unknown = np.full((search.inside.height, search.inside.width), np.nan, dtype=np.float32)
    right_px = np.empty((search.inside.height, 0), dtype=np.float32)
    return _result(search, CensusSettings(), unknown, right_px, np.zeros_like(unknown), np.nan)


def _result(
    search: Search,
    settings: CensusSettings,
    left_px: NDArray[np.float32],
    right_px: NDArray[np.float32],
    confidence: NDArray[np.float32],
    agreement: float,
) -> TwoViewDisparity:
    box, inside = search.box, search.inside
    right_rows = np.full((box.height, right_px.shape[1]), np.nan, dtype=np.float32)
    top = inside.y - box.y
    right_rows[top : top + inside.height] = right_px
    return TwoViewDisparity(
        matched_map(search, left_px, settings.sigma_px),
        right_rows,
        search.right.x,
        search.over_box(confidence, np.float32(0.0)),
        agreement,
    )


def matched_map(search: Search, disparity_px: NDArray[np.float32], sigma_px: float) -> DisparityMap:
    """The map over the whole box; (h, w) of its inside part, NaN where unmatched."""
    whole = search.over_box(disparity_px.astype(np.float32), np.float32(np.nan))
    is_matched = np.isfinite(whole)
    return DisparityMap(
        whole,
        np.where(is_matched, sigma_px, np.nan).astype(np.float32),
        np.where(is_matched, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8),
        search.box.x,
        search.box.y,
    )
