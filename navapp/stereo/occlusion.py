"""Which pixels have no partner in the other view, and why.

In the left view a border occlusion is the strip that the right camera does not see; an interior
occlusion stands left of something nearer, and no right pixel maps to it; the rest of the unmatched
pixels are mismatches. The class decides from which side a pixel may be filled.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.stereo.bands import in_row_bands
from navapp.stereo.occlusion_kernels import edge_splits, mark_seen, strip_ends, withdraw
from navapp.values import DisparityMap, Origin

# The strip's end is agreed over this many rows above and below.
_STRIP_ROWS = 4


def classify(
    left: DisparityMap,
    right_px: NDArray[np.float32],
    right_x0: int,
    picture_width: int,
    picture: NDArray[np.uint8] | None = None,
) -> NDArray[np.uint8]:
    """Class of every pixel that is not, or not believably, matched.

    Args:
        left: of the left view; for the right view see `mirrored`.
        right_px: (h, W) float32 disparity of the right view in the same rows, NaN where unknown.
        right_x0: column of its first pixel in the rectified right picture.
        picture_width: of the rectified pictures.
        picture: (h, w) or (h, w, 3) rectified left picture over the map. With it, matches at the
            left edge of near objects that look like the background are withdrawn: a matching
            window hangs over the edge and gives the background the object's disparity.

    Returns:
        (h, w) 0 where the match stands and outside the picture, else the `Origin` that a filled
        pixel gets. A class on a matched pixel withdraws that match.

    Raises:
        ValueError: another number of rows, or a picture of another size.

    Source: the paper, section 3.2 (border and non-border occlusions).
    """
    height, width = left.disparity_px.shape
    if right_px.shape[0] != height:
        raise ValueError("classify needs both views over the same rows")
    matched = left.origin == Origin.MATCHED
    seen = np.zeros((height, width), dtype=bool)
    right_px = np.ascontiguousarray(right_px, dtype=np.float32)
    in_row_bands(
        height, lambda first, last: mark_seen(right_px, right_x0 - left.x, first, last, seen)
    )
    is_border = _border_strip(left, matched)
    matched &= ~is_border
    withdrawn = np.zeros_like(matched)
    if picture is not None:
        colours = as_three_channels(picture, left)
        splits = np.full((height, width), -1, dtype=np.int8)
        in_row_bands(
            height,
            lambda first, last: edge_splits(
                left.disparity_px, matched, colours, first, last, splits
            ),
        )
        withdraw(splits, withdrawn)
        withdrawn &= matched
    classes = np.where(seen, np.uint8(Origin.MISMATCH_FILLED), np.uint8(Origin.FILLED_INTERIOR))
    classes[withdrawn] = Origin.FILLED_INTERIOR
    matched &= ~withdrawn
    # What hides an interior occlusion stands right of it, what was hidden left and farther.
    is_possible = _left_neighbour_is_farther(left.disparity_px, matched)
    classes[~is_possible] = Origin.MISMATCH_FILLED
    classes[matched] = 0
    classes[is_border] = Origin.FILLED_BORDER
    columns = left.x + np.arange(width)
    classes[:, (columns < 0) | (columns >= picture_width)] = 0
    return classes


def mirrored(disparity_map: DisparityMap, picture_width: int) -> DisparityMap:
    """The map seen in a mirror; a mirrored right view obeys the rules of a left one.

    To treat the right view, mirror its map and flip its picture; the left view's disparity,
    flipped, takes the part of `right_px`, with `picture_width - x - width` as its first column.
    Mirroring twice gives the map back.
    """
    width = disparity_map.disparity_px.shape[1]
    return DisparityMap(
        np.ascontiguousarray(disparity_map.disparity_px[:, ::-1]),
        np.ascontiguousarray(disparity_map.sigma_px[:, ::-1]),
        np.ascontiguousarray(disparity_map.origin[:, ::-1]),
        picture_width - disparity_map.x - width,
        disparity_map.y,
    )


def as_three_channels(picture: NDArray[np.uint8], over: DisparityMap) -> NDArray[np.int16]:
    """The picture as (h, w, 3) whose differences do not wrap around; grey counts three times.

    Raises:
        ValueError: another size than the map's.
    """
    if picture.shape[:2] != over.disparity_px.shape or picture.shape[2:] not in ((), (3,)):
        raise ValueError("the picture must be grey or have three channels over the map's box")
    colours = np.empty((*picture.shape[:2], 3), dtype=np.int16)
    colours[...] = picture if picture.ndim == 3 else picture[:, :, None]
    return colours


def _border_strip(left: DisparityMap, matched: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels left of the agreed end of the strip without a partner."""
    height, width = matched.shape
    ends = np.empty(height)
    strip_ends(left.disparity_px, matched, left.x, ends)
    padded = np.pad(ends, _STRIP_ROWS, constant_values=np.nan)
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * _STRIP_ROWS + 1)
    agreed = np.zeros(height)
    has_end = np.isfinite(around).any(axis=1)
    if has_end.any():
        agreed[has_end] = np.nanmedian(around[has_end], axis=1)
    return np.asarray(np.arange(width)[None, :] < np.floor(agreed)[:, None])


def _left_neighbour_is_farther(
    disparity: NDArray[np.float32], matched: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Whether the nearest match on the left is not nearer than the one on the right, if any."""
    width = disparity.shape[1]
    columns = np.arange(width)
    before = np.maximum.accumulate(np.where(matched, columns, -1), axis=1)
    after = np.minimum.accumulate(np.where(matched, columns, width)[:, ::-1], axis=1)[:, ::-1]
    on_left = np.take_along_axis(disparity, np.maximum(before, 0), axis=1)
    on_right = np.take_along_axis(disparity, np.minimum(after, width - 1), axis=1)
    return np.asarray((before >= 0) & ((after == width) | (on_left <= on_right)))
