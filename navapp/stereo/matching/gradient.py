"""The paper's state of the art, kept for comparison: sum of gradient magnitudes over a window.

Algorithm 1 of its state-of-the-art section: cost (equation 2), aggregation, winner takes all
(equation 3), left-right check. Disparities are whole pixels; only the Gaussian filter that the
paper puts behind them, `smooth_known`, moves them in between.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.box import Box
from navapp.geometry.rectification import Image, RectifiedPair
from navapp.stereo.matching.census_sgm import TwoViewDisparity, make_matched_map
from navapp.stereo.matching.consistency import at_partner, view_difference_px
from navapp.stereo.matching.gradient_kernels import match_rows
from navapp.stereo.matching.search import Crop, Search

_PER_GREY = 16.0


@dataclass(frozen=True, slots=True)
class GradientSettings:
    """How the baseline works."""

    window_px: int = 11  # side of the window, odd
    max_difference_px: float = 1.0  # between the two views
    contrast_grey: int = 3  # a window with a smaller range of grey levels matches nothing
    sigma_px: float = 0.5  # standard deviation that is claimed for every match

    def __post_init__(self) -> None:
        if self.window_px < 1 or self.window_px % 2 == 0:
            raise ValueError(f"the window's side must be odd and positive, not {self.window_px}")


def match_gradient(
    pair: RectifiedPair, band_px: tuple[float, float], settings: GradientSettings | None = None
) -> TwoViewDisparity:
    """Match the box of a rectified pair as the paper's state of the art does.

    Args:
        pair: rectified grey pictures; `pair.box` is matched and may reach beyond them.
        band_px: smallest and largest disparity expected.
        settings: of the baseline.

    Returns:
        Both views over `pair.box`; inconsistent pixels of the left one are unknown, nothing is
        filled or filtered. Every match is as confident as another.

    Raises:
        ValueError: pictures that are not grey or differ in size, a band that is none or of more
            than 1024 disparities.

    Source: Algorithm 1, equations (2) and (3). The printed m_r(x, y, d) is read as the right
    magnitude shifted by d, m_r(x - d, y).
    """
    settings = settings or GradientSettings()
    search = Search.plan(pair, band_px)
    box, inside = search.box, search.inside
    left_px = np.full((inside.height, inside.width), np.nan, dtype=np.float32)
    right_px = np.full((box.height, search.right.width), np.nan, dtype=np.float32)
    if not search.is_empty:
        top = inside.y - box.y
        left_px, right_px[top : top + inside.height] = _match_both(pair, search, settings)
    left = make_matched_map(search, left_px, settings.sigma_px)
    is_matched = left.origin.astype(np.float32)
    return TwoViewDisparity(left, right_px, search.right.x, is_matched, left.matched_fraction)


def _match_both(
    pair: RectifiedPair, search: Search, settings: GradientSettings
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Disparity of the left view's inside, checked, and of the right view."""
    left_px, right_px = _winners(pair, search, settings)
    # Left-right consistency check: the right view's winners come from the same cost.
    is_matched = view_difference_px(left_px, right_px, search.shift) <= settings.max_difference_px
    radius = settings.window_px // 2
    left_spread, right_spread = (
        Crop.of(image, box, (radius, radius)).contrast_grey()
        for image, box in ((pair.left, search.inside), (pair.right, search.right))
    )
    partner_spread = at_partner(right_spread, left_px, search.shift, np.uint8(0))
    is_matched &= np.minimum(left_spread, partner_spread) >= settings.contrast_grey
    return np.where(is_matched, left_px, np.float32(np.nan)), right_px


def smooth_known(values: NDArray[np.float32], sigma_px: float) -> NDArray[np.float32]:
    """Gaussian filter over the known pixels; unknown ones (NaN) stay unknown and weigh nothing."""
    import cv2

    if sigma_px <= 0.0:
        return values
    is_known = np.isfinite(values)
    weight = cv2.GaussianBlur(is_known.astype(np.float32), (0, 0), sigma_px)
    blurred = cv2.GaussianBlur(np.where(is_known, values, 0.0), (0, 0), sigma_px)
    # A known pixel weighs at least its own tap, so the divisor is never small where it counts.
    smooth = np.asarray(blurred) / np.where(is_known, weight, 1.0)
    return np.where(is_known, smooth, np.nan).astype(np.float32)


def magnitude(image: Image) -> NDArray[np.int32]:
    """(h, w) m = sqrt(gx^2 + gy^2) in 1/16 grey per px, from central differences."""
    padded = np.pad(image.astype(np.float32), 1, mode="edge")
    gx = 0.5 * (padded[1:-1, 2:] - padded[1:-1, :-2])
    gy = 0.5 * (padded[2:, 1:-1] - padded[:-2, 1:-1])
    return np.asarray(np.rint(_PER_GREY * np.sqrt(gx * gx + gy * gy)), dtype=np.int32)


def _magnitude_around(image: Image, box: Box, radius: int) -> NDArray[np.int32]:
    """As `magnitude`, in a box and so far around it; 0 elsewhere."""
    height, width = image.shape
    # A pixel more: the outermost slopes of a part are one-sided.
    part = box.grow(radius + 1).clip(width, height).slices
    found = np.zeros(image.shape, dtype=np.int32)
    found[part] = magnitude(image[part])
    return found


def _winners(
    pair: RectifiedPair, search: Search, settings: GradientSettings
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Winners of the left view's inside and of the right view, unchecked; NaN where none."""
    inside, n = search.inside, search.count
    radius = settings.window_px // 2
    first = inside.x - (search.lowest + n - 1)
    reached = Box(first, inside.y, inside.width + n - 1, inside.height)
    left, right = (
        Crop.of(_magnitude_around(picture, box, radius), box, (radius, radius)).values
        for picture, box in ((pair.left, inside), (pair.right, reached))
    )
    mirrored = np.ascontiguousarray(right[:, ::-1])
    left_best = np.empty((inside.height, inside.width), dtype=np.int32)
    right_best = np.empty((reached.height, reached.width), dtype=np.int32)
    # Only partners inside the picture compete.
    past = first + reached.width
    columns = (past - search.right.x - search.right.width, past - search.right.x)
    # SG(x, y, d) = 1 / w^2 sum over the window |m_l(x, y) - m_r(x - d, y)|         (equation 2)
    # is the cost and, over the whole window, its aggregation CA; w^2 moves no minimum.
    # d = arg min over D of CA(p, d)                                                (equation 3)
    in_row_bands(
        inside.height,
        lambda rows: match_rows(left, mirrored, columns, rows, left_best, right_best),
    )
    # The best at the end of the search is no minimum.
    is_minimum = (left_best > 0) & (left_best < n - 1)
    left_px = np.where(is_minimum, left_best + search.lowest, np.nan).astype(np.float32)
    # Columns of `reached` that lie outside the picture have no winners.
    right_best = right_best[:, ::-1][:, search.right.x - first :][:, : search.right.width]
    right_px = np.where(right_best >= 0, right_best + search.lowest, np.nan).astype(np.float32)
    return left_px, right_px
