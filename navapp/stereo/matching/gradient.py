"""The paper's state of the art, kept for comparison: sum of gradient magnitudes over a window.

Algorithm 1 of its state-of-the-art section: cost (equation 2), aggregation, winner takes all
(equation 3), left-right check. Disparities are whole pixels; only the Gaussian filter that the
paper puts behind them, `smooth_known`, moves them in between.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.box import Box
from navapp.geometry.rectification import Image, RectifiedPair
from navapp.stereo.matching.census_sgm import (
    TwoViewDisparity,
    check_views,
    make_answer,
    make_nothing,
)
from navapp.stereo.matching.consistency_kernels import Demands, Evidence
from navapp.stereo.matching.search import MAX_DISPARITIES, Search, contrast_grey, crop

# Magnitudes are whole numbers of 1/16 grey: sums over windows are exact, and stay below 2^21 ...
_PER_GREY = 16.0
# ... so that a cost and the number of its disparity, below 2^10, fit together into 31 bits.
_NOTHING = np.iinfo(np.int32).max
# Of the square window.
_RADIUS_PX = 5
_SIGMA_PX = 0.5  # standard deviation that is claimed for every match
# A window with a smaller range of grey levels matches nothing; views may differ by a pixel.
_DEMANDS = Demands(3, np.float32(1.0), np.float32(1.0), np.float32(0.0))


def match_gradient(pair: RectifiedPair, band_px: tuple[float, float]) -> TwoViewDisparity:
    """Match the box of a rectified pair as the paper's state of the art does.

    Args:
        pair: rectified grey pictures; `pair.box` is matched and may reach beyond them.
        band_px: smallest and largest disparity expected.

    Returns:
        Both views over `pair.box`; inconsistent pixels of the left one are unknown, nothing is
        filled or filtered. Every match is as confident as another.

    Raises:
        ValueError: pictures that are not grey or differ in size, a band that is none or of more
            than 1024 disparities.

    Source: Algorithm 1, equations (2) and (3). The printed m_r(x, y, d) is read as the right
    magnitude shifted by d, m_r(x - d, y).
    """
    search = Search.plan(pair, band_px)
    if search.is_empty:
        return make_nothing(search)
    left_px, right_px = find_winners(pair, search)
    margin = (_RADIUS_PX, _RADIUS_PX)
    left_contrast, right_contrast = (
        contrast_grey(crop(image, box, margin), margin)
        for image, box in ((pair.left, search.inside), (pair.right, search.right))
    )
    # Left-right consistency check: the right view's winners come from the same cost.
    evidence = Evidence(
        left_px, right_px, np.ones_like(left_px), left_contrast, right_contrast, search.shift
    )
    is_judged, _ = check_views(evidence, _DEMANDS)
    is_matched = np.isfinite(left_px).astype(np.float32)
    return make_answer(search, _SIGMA_PX, left_px, right_px, is_matched, is_judged)


def smooth_known(values: NDArray[np.float32], sigma_px: float) -> NDArray[np.float32]:
    """Gaussian filter over the known pixels; unknown ones (NaN) stay unknown and weigh nothing."""
    import cv2

    is_known = np.isfinite(values)
    weight = cv2.GaussianBlur(is_known.astype(np.float32), (0, 0), sigma_px)
    blurred = cv2.GaussianBlur(np.where(is_known, values, 0.0), (0, 0), sigma_px)
    # A known pixel weighs at least its own tap, so the divisor is never small where it counts.
    smooth = np.asarray(blurred) / np.where(is_known, weight, 1.0)
    return np.where(is_known, smooth, np.nan).astype(np.float32)


def magnitude(image: Image) -> NDArray[np.uint16]:
    """(h, w) m = sqrt(gx^2 + gy^2) in 1/16 grey per px, from central differences."""
    padded = np.pad(image.astype(np.float32), 1, mode="edge")
    gx = 0.5 * (padded[1:-1, 2:] - padded[1:-1, :-2])
    gy = 0.5 * (padded[2:, 1:-1] - padded[:-2, 1:-1])
    return np.asarray(np.rint(_PER_GREY * np.sqrt(gx * gx + gy * gy)), dtype=np.uint16)


def _magnitude_around(image: Image, box: Box, radius: int) -> NDArray[np.uint16]:
    """As `magnitude`, in a box and so far around it; 0 elsewhere."""
    height, width = image.shape
    # A pixel more: the outermost slopes of a part are one-sided.
    part = box.grow(radius + 1).clip(width, height).slices
    found = np.zeros(image.shape, dtype=np.uint16)
    found[part] = magnitude(image[part])
    return found


def find_winners(
    pair: RectifiedPair, search: Search
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Disparity of the left view's inside and of the right view, unchecked; NaN where none.

    Winner takes all; of equal costs the smallest disparity wins.
    """
    margin = (_RADIUS_PX, _RADIUS_PX)
    views = tuple(
        crop(_magnitude_around(picture, box, _RADIUS_PX), box, margin)
        for picture, box in ((pair.left, search.inside), (pair.right, search.right))
    )
    best = tuple(
        np.full((box.height, box.width), _NOTHING, dtype=np.int32)
        for box in (search.inside, search.right)
    )
    in_row_bands(search.inside.height, lambda rows: _choose(views, search, rows, best))
    left, right = (offer % MAX_DISPARITIES for offer in best)
    # The best at the end of the search is no minimum.
    is_minimum = (best[0] < _NOTHING) & (left > 0) & (left < search.count - 1)
    left_px = np.where(is_minimum, left + search.lowest, np.nan).astype(np.float32)
    right_px = np.where(best[1] < _NOTHING, right + search.lowest, np.nan).astype(np.float32)
    return left_px, right_px


def _choose(
    views: tuple[NDArray[np.uint16], ...],
    search: Search,
    rows: tuple[int, int],
    best: tuple[NDArray[np.int32], ...],
) -> None:
    """What is best in both views for some rows.

    The right view's cost of pixel u at disparity d is that of left pixel u + d.

    Args:
        views: magnitudes of `search.inside` and `search.right`, with a margin of the window's
            radius.
        search: what is searched.
        rows: first, and after the last, to fill.
        best: (h, w) and (h, W) in place: lowest cost * `MAX_DISPARITIES` + its disparity's number.
    """
    import cv2

    window, here = 2 * _RADIUS_PX + 1, slice(*rows)
    left, right = (view[rows[0] : rows[1] + window - 1] for view in views)
    for k in range(search.count):
        # Only partners inside the picture compete.
        offset = search.shift - search.lowest - k
        first = max(-offset, 0)
        after = min(search.inside.width, search.right.width - offset)
        if first >= after:
            continue
        # SG(x, y, d) = 1 / w^2 sum over the window |m_l(x, y) - m_r(x - d, y)|     (equation 2)
        # is the cost and, over the whole window, its aggregation CA; w^2 moves no minimum.
        # d = arg min over D of CA(p, d)                                            (equation 3)
        seen, faced = slice(first, after), slice(first + offset, after + offset)
        difference = cv2.absdiff(
            left[:, first : after + window - 1], right[:, faced.start : faced.stop + window - 1]
        )
        sums = cv2.boxFilter(difference, cv2.CV_32S, (window, window), normalize=False)
        offer = sums[_RADIUS_PX:-_RADIUS_PX, _RADIUS_PX:-_RADIUS_PX]
        offer *= MAX_DISPARITIES
        offer += k
        for lowest, columns in zip(best, (seen, faced), strict=True):
            part = lowest[here, columns]
            np.minimum(part, offer, out=part)
