"""Do the two views of a match agree?

Right pictures are addressed by `shift`: the left map's column 0 is the right map's column `shift`.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T", bound=np.generic)

# Fixed point of OpenCV's speckle filter; 1,024 disparities stay far from its mark.
_PER_PX = 16.0
_NO_DISPARITY = -16000


def at_partner(
    right_values: NDArray[T], disparity_px: NDArray[np.float32], shift: int, missing: T
) -> NDArray[T]:
    """The right view's value at each left pixel's partner.

    The partner of column x is column floor(x + shift - d + 0.5): the nearest whole column, the
    right one of two equally near.

    Args:
        right_values: (h, W).
        disparity_px: (h, w), NaN where unknown.
        shift: right column of the left column 0 at disparity 0.
        missing: where the disparity is unknown or the partner outside.
    """
    height, width = disparity_px.shape
    right_width = right_values.shape[1]
    if right_width == 0:
        return np.full((height, width), missing, dtype=right_values.dtype)
    position = np.floor(np.arange(width) + (shift + 0.5) - disparity_px.astype(np.float64))
    is_inside = (position >= 0.0) & (position <= right_width - 1)
    column = np.where(is_inside, position, 0.0).astype(np.intp)
    values = np.take_along_axis(right_values, column, axis=1)
    return np.asarray(np.where(is_inside, values, missing), dtype=right_values.dtype)


def view_difference_px(
    left_px: NDArray[np.float32], right_px: NDArray[np.float32], shift: int
) -> NDArray[np.float32]:
    """(h, w) |d_R(x - d) - d|; NaN where there is no partner, or none with a disparity."""
    partner_px = at_partner(right_px, left_px, shift, np.float32(np.nan))
    return np.asarray(np.abs(partner_px - left_px), dtype=np.float32)


def speckle_free(
    disparity_px: NDArray[np.float32], least_px: int, max_step_px: float
) -> NDArray[np.bool_]:
    """(h, w) known pixels in a connected patch of at least `least_px` pixels.

    Neighbours (four of them) are connected when their disparities differ by up to `max_step_px`.
    """
    import cv2

    is_known = np.isfinite(disparity_px)
    if not is_known.any():
        return is_known
    from_lowest = disparity_px - disparity_px[is_known].min()
    fixed = np.where(is_known, np.rint(from_lowest * _PER_PX), _NO_DISPARITY).astype(np.int16)
    cv2.filterSpeckles(fixed, _NO_DISPARITY, least_px - 1, round(max_step_px * _PER_PX))
    return np.asarray(fixed != _NO_DISPARITY)


def agreement_share(agrees: NDArray[np.bool_], is_judged: NDArray[np.bool_]) -> float:
    """Share of the judged pixels whose views agree; NaN when none is judged.

    Exchanged pictures give a tiny share.
    """
    return float(agrees[is_judged].mean()) if is_judged.any() else float("nan")
