"""Filling of occlusions in the paper's directions.

In the left view a border occlusion (the strip that the right camera does not see) is filled from
right to left, an interior occlusion (hidden by something nearer) from left to right, because the
background stands on its left. Anything else unmatched is a mismatch and takes the farther of its
two neighbours. Filled pixels keep their origin: they make a picture whole, they measure nothing.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.values import DisparityMap, Origin

# A gap wider than this is no occlusion of a knee's parts: nothing is invented there.
MAX_GAP_PX = 40

_FILLED_SIGMA_PX = 5.0


def fill_occlusions(disparity_map: DisparityMap, max_gap_px: int = MAX_GAP_PX) -> DisparityMap:
    """The map with its occlusions filled; matched pixels are not touched.

    Args:
        disparity_map: of the left view.
        max_gap_px: a pixel further than this from its permitted neighbour stays unknown.

    Source: the paper, section 3.2 (weighted least squares step: which side may speak).
    """
    disparity = disparity_map.disparity_px
    known = np.isfinite(disparity)
    from_left, left_gap = _nearest_known(disparity, known, step=1)
    from_right, right_gap = _nearest_known(disparity, known, step=-1)

    columns = disparity_map.x + np.arange(disparity.shape[1])
    nothing_on_left = ~np.isfinite(from_left)
    is_border = ~known & nothing_on_left & (columns - from_right < 0.0)
    is_interior = ~known & ~is_border & _is_hidden(disparity, known, from_left)
    is_mismatch = ~known & ~is_border & ~is_interior

    # NaN on the left compares as false: then the right neighbour speaks, however near it is.
    takes_left = (from_left <= from_right) | ~np.isfinite(from_right)
    farther = np.where(takes_left, from_left, from_right)
    farther_gap = np.where(takes_left, left_gap, right_gap)
    filled = disparity.copy()
    origin = disparity_map.origin.copy()
    sigma = disparity_map.sigma_px.copy()
    for where, value, gap, label in (
        (is_border, from_right, right_gap, Origin.FILLED_BORDER),
        (is_interior, from_left, left_gap, Origin.FILLED_INTERIOR),
        (is_mismatch, farther, farther_gap, Origin.MISMATCH_FILLED),
    ):
        usable = where & np.isfinite(value) & (gap <= max_gap_px)
        filled[usable] = value[usable]
        origin[usable] = label
        sigma[usable] = _FILLED_SIGMA_PX
    return DisparityMap(filled, sigma, origin, disparity_map.x, disparity_map.y)


def _nearest_known(
    disparity: NDArray[np.float32], known: NDArray[np.bool_], step: int
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Nearest known disparity to the left (step 1) or right (-1) of each pixel, and how far."""
    values, mask = disparity[:, ::step], known[:, ::step]
    width = values.shape[1]
    columns = np.arange(width)
    last = np.maximum.accumulate(np.where(mask, columns, -1), axis=1)
    nearest = np.take_along_axis(values, np.maximum(last, 0), axis=1)
    nearest = np.where(last >= 0, nearest, np.nan).astype(np.float32)
    gap = np.where(last >= 0, columns - last, np.iinfo(np.int32).max)
    return nearest[:, ::step], gap[:, ::step]


def _is_hidden(
    disparity: NDArray[np.float32], known: NDArray[np.bool_], assumed: NDArray[np.float32]
) -> NDArray[np.bool_]:
    """Pixels whose right partner, at the assumed disparity, shows something nearer."""
    height, width = disparity.shape
    # Nearest (largest) disparity that lands on each column of the right view. Partners may lie left
    # of the box: columns are counted from the smallest one that occurs.
    if not known.any():
        return np.zeros_like(known)
    shift = int(np.ceil(np.nanmax(disparity))) + 1
    nearest = np.full((height, width + shift), -np.inf, dtype=np.float32)
    rows, columns = np.nonzero(known)
    values = disparity[rows, columns]
    partner = np.floor(columns - values + 0.5).astype(int) + shift
    np.maximum.at(nearest, (rows, np.clip(partner, 0, width + shift - 1)), values)
    hidden = np.zeros_like(known)
    rows, columns = np.nonzero(~known & np.isfinite(assumed))
    partner = np.floor(columns - assumed[rows, columns] + 0.5).astype(int) + shift
    inside = (partner >= 0) & (partner < width + shift)
    rows, columns, partner = rows[inside], columns[inside], partner[inside]
    hidden[rows, columns] = nearest[rows, partner] > assumed[rows, columns] + 1.0
    return hidden
