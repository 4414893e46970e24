"""Disparity of both views without a pose: census distances, semi-global aggregation.

Sub-pixel places come from a parabola through whole disparities, which leans towards whole pixels:
good as a support, to be refined for geometry.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands, run_both
from navapp.geometry.lane_kernels import WHOLE_LANES, lanes_for
from navapp.geometry.masks import large_smooth_regions
from navapp.geometry.rectification import Image, RectifiedPair
from navapp.stereo.matching.census_kernels import census_rows
from navapp.stereo.matching.choice_kernels import Choice, choose_rows
from navapp.stereo.matching.consistency_kernels import Demands, Evidence, judge_rows
from navapp.stereo.matching.search import Search, contrast_grey, crop
from navapp.stereo.matching.sgm_kernels import (
    MAX_PENALTY,
    NONE,
    Views,
    jump_penalties,
    keep_rows,
    mirror_codes,
    new_paths,
    surplus_dtype,
)
from navapp.values import DisparityMap, Origin

_MAX_VOLUME_BYTES = 2 * 1024**3
_MAX_CODE_BITS = 64


@dataclass(frozen=True, slots=True)
class CensusSettings:
    """How the matcher works."""

    # radius_x, radius_y: of the census window, px; at most 65 pixels in it.
    radius_x: int = 2
    radius_y: int = 2
    p1: int = 6  # penalty of a step of one disparity between neighbours
    # penalty of a larger step, divided by 1 + (grey step) / `edge_grey`. Above 63, twice the memory
    # is needed.
    p2: int = 40
    edge_grey: int = 8  # grey step that halves `p2`
    max_difference_px: float = 1.0  # between the two views, and between neighbours of one patch
    # how much worse than the best, as a share of it, the best disparity that is no neighbour must
    # be.
    min_uniqueness: float = 0.05
    speckle_px: int = 60  # smaller patches of similar disparity are removed
    # a window with a smaller range of grey levels (no light, glare) matches everything, so it
    # matches nothing.
    contrast_grey: int = 3
    # range of grey levels from which texture no longer lowers the confidence.
    full_contrast_grey: int = 16
    sigma_px: float = 0.2  # standard deviation that is claimed for every match

    def __post_init__(self) -> None:
        if min(self.radius_x, self.radius_y) < 0 or not 0 < self.code_bits <= _MAX_CODE_BITS:
            raise ValueError(f"a census window needs 2 to {_MAX_CODE_BITS + 1} pixels")
        if not 0 < self.p1 < self.p2 <= MAX_PENALTY or self.edge_grey < 1:
            raise ValueError(f"penalties must be 0 < p1 < p2 <= {MAX_PENALTY}, edge_grey >= 1")

    @property
    def code_bits(self) -> int:
        """Neighbours in the window."""
        return (2 * self.radius_x + 1) * (2 * self.radius_y + 1) - 1


@dataclass(frozen=True, slots=True, eq=False)
class FillEvidence:
    """What a fill asks besides the left map: the right view, and trust in the left one."""

    # (h, W) float32 disparity of the right view, whole pixels, NaN unknown; rows of the box.
    # Unchecked: what the right view prefers among the box's pixels.
    right_px: NDArray[np.float32]
    right_x0: int  # right column of `right_px`'s first column
    # (h, w) float32, 0 to 1, from uniqueness, texture and the agreement of the views; 0 where
    # unmatched.
    confidence: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class TwoViewDisparity(FillEvidence):
    """What one aggregated cost says about both views."""

    # over the pair's box; only consistent pixels are matched, nothing is filled.
    left: DisparityMap
    # share of the pixels with contrast that are matched; tiny when the pictures are exchanged, NaN
    # when no pixel of either view has contrast.
    agreement: float


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """One picture's crop as the matcher sees it."""

    grey: Image  # (h, w)
    codes: NDArray[np.uint8]  # (h, bytes, w) of the census
    contrast_grey: NDArray[np.uint8]  # (h, w) range of grey levels around each pixel


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
            than 1024 disparities, a cost volume of more than 2 GiB.

    Source: census transform, Zabih and Woodfill 1994; aggregation along eight paths, Hirschmueller
    2008.
    """
    settings = settings or CensusSettings()
    search = Search.plan(pair, band_px)
    _check_volume(search, settings)
    if search.is_empty:
        return make_nothing(search)
    left, right = _views_of(pair, search, settings)
    left_px, right_px, uniqueness = _aggregate_and_choose(left, right, search, settings)
    evidence = Evidence(
        left_px, right_px, uniqueness, left.contrast_grey, right.contrast_grey, search.shift
    )
    demands = Demands(
        settings.contrast_grey,
        np.float32(settings.full_contrast_grey),
        np.float32(settings.max_difference_px),
        np.float32(settings.min_uniqueness),
    )
    is_judged, confidence = check_views(evidence, demands)
    # Smooth paths agree by chance too, but in specks.
    is_matched = large_smooth_regions(left_px, settings.speckle_px, settings.max_difference_px)
    np.copyto(left_px, np.float32(np.nan), where=~is_matched)
    np.copyto(confidence, np.float32(0.0), where=~is_matched)
    return make_answer(search, settings.sigma_px, left_px, right_px, confidence, is_judged)


def check_views(
    evidence: Evidence, demands: Demands
) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """(h, w) whether a left pixel could be judged, and confidence; see `judge_rows`."""
    is_judged = np.empty(evidence.left_px.shape, dtype=np.bool_)
    confidence = np.empty_like(evidence.left_px)
    judge = partial(judge_rows, evidence, demands, is_judged=is_judged, confidence=confidence)
    in_row_bands(len(is_judged), judge)
    return is_judged, confidence


def _check_volume(search: Search, settings: CensusSettings) -> None:
    cells = search.inside.width * search.inside.height * lanes_for(search.count, WHOLE_LANES)
    n_bytes = cells * np.dtype(surplus_dtype(settings.p2)).itemsize
    if n_bytes > _MAX_VOLUME_BYTES:
        raise ValueError(
            f"a box of {search.inside.width}x{search.inside.height} px with {search.count} "
            f"disparities needs {n_bytes / 1024**3:.1f} GiB, at most "
            f"{_MAX_VOLUME_BYTES // 1024**3} are used: take a smaller box or band"
        )


def _views_of(pair: RectifiedPair, search: Search, settings: CensusSettings) -> tuple[_View, _View]:
    """What the matcher sees of the left and of the right picture."""
    radius = (settings.radius_x, settings.radius_y)
    views, fills = [], []
    for image, box in ((pair.left, search.inside), (pair.right, search.right)):
        cropped = crop(image, box, radius)
        codes = np.empty((box.height, -(-settings.code_bits // 8), box.width), dtype=np.uint8)
        fills.append(partial(census_rows, cropped, *radius, (0, box.height), codes))
        grey = np.ascontiguousarray(image[box.slices])
        views.append(_View(grey, codes, contrast_grey(cropped, radius)))
    run_both(*fills)
    return views[0], views[1]


def _aggregate_and_choose(
    left: _View, right: _View, search: Search, settings: CensusSettings
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Disparity of the left and of the right view, uniqueness of the left.

    Each scan begins at its end of the picture and keeps what it finds in the first half. From where
    they meet, each finds what the other has kept and chooses the disparities on its way: half of
    the memory, and no third pass over it.
    """
    height, width = left.grey.shape
    n = lanes_for(search.count, WHOLE_LANES)
    views = _views(left, right, search, settings)
    kept = np.empty((height, width, n), dtype=surplus_dtype(settings.p2))
    choice = Choice(
        np.empty((height, width), dtype=np.float32),
        np.empty(right.grey.shape, dtype=np.float32),
        np.empty((height, width), dtype=np.float32),
        search.lowest,
        search.count,
    )
    down, up = new_paths(width, n), new_paths(width, n)
    middle = height // 2
    run_both(
        partial(keep_rows, views, down, (0, middle), 1, kept),
        partial(keep_rows, views, up, (height - 1, middle - 1), -1, kept),
    )
    run_both(
        partial(choose_rows, views, down, (middle, height), 1, kept, choice),
        partial(choose_rows, views, up, (middle - 1, -1), -1, kept, choice),
    )
    return choice.left_px, choice.right_px, choice.uniqueness


def _views(left: _View, right: _View, search: Search, settings: CensusSettings) -> Views:
    n = lanes_for(search.count, WHOLE_LANES)
    return Views(
        left.codes,
        mirror_codes(right.codes, n),
        left.grey,
        search.shift - search.lowest,
        np.uint8(settings.p1),
        jump_penalties(settings.p1, settings.p2, settings.edge_grey),
        # Neither cheap nor dear: the path decides about a pixel whose partner is outside.
        np.uint8(settings.code_bits // 2),
        np.pad(np.zeros(right.grey.shape[1], dtype=np.uint8), n, constant_values=NONE),
        np.where(np.arange(n) < search.count, 0, NONE).astype(np.uint8),
    )


def make_nothing(search: Search) -> TwoViewDisparity:
    """The answer of a search without partners: all is unknown."""
    unknown = np.full((search.inside.height, search.inside.width), np.nan, dtype=np.float32)
    right_px = np.empty((search.inside.height, 0), dtype=np.float32)
    is_judged = np.zeros(unknown.shape, dtype=np.bool_)
    return make_answer(search, 0.0, unknown, right_px, np.zeros_like(unknown), is_judged)


def make_answer(
    search: Search,
    sigma_px: float,
    left_px: NDArray[np.float32],
    right_px: NDArray[np.float32],
    confidence: NDArray[np.float32],
    is_judged: NDArray[np.bool_],
) -> TwoViewDisparity:
    """What was found inside the pictures, laid into the whole box.

    Args:
        search: what was searched.
        sigma_px: standard deviation that is claimed for every match.
        left_px: (h, w) float32 of `search.inside`, NaN where unmatched.
        right_px: (h, W) of `search.right`.
        confidence: (h, w), 0 where unmatched.
        is_judged: (h, w) of `check_views`.
    """
    box, inside = search.box, search.inside
    right_rows = np.full((box.height, right_px.shape[1]), np.nan, dtype=np.float32)
    top = inside.y - box.y
    right_rows[top : top + inside.height] = right_px
    whole = search.over_box(left_px, np.float32(np.nan))
    # Unknown where the disparity is: NaN less NaN.
    sigma = whole - whole + np.float32(sigma_px)
    origin = np.isfinite(whole).astype(np.uint8) * np.uint8(Origin.MATCHED)
    n_judged = np.count_nonzero(is_judged)
    return TwoViewDisparity(
        right_rows,
        search.right.x,
        search.over_box(confidence, np.float32(0.0)),
        DisparityMap(whole, sigma, origin, box.x, box.y),
        # Exchanged pictures give a tiny share. Only what was judged is matched.
        np.count_nonzero(origin) / n_judged if n_judged else np.nan,
    )
