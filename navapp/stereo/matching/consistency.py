"""Do the two views of a match agree?

Right pictures are addressed by `shift`: the left map's column 0 is the right map's column `shift`.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from navapp.stereo.matching.consistency_kernels import partner_values

T = TypeVar("T", bound=np.generic)


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
    values = np.empty((height, width), dtype=right_values.dtype)
    partner_values(
        np.ascontiguousarray(right_values),
        np.ascontiguousarray(disparity_px),
        shift,
        missing,
        values,
    )
    return values


def view_difference_px(
    left_px: NDArray[np.float32], right_px: NDArray[np.float32], shift: int
) -> NDArray[np.float32]:
    """(h, w) |d_R(x - d) - d|; NaN where there is no partner, or none with a disparity."""
    partner_px = at_partner(right_px, left_px, shift, np.float32(np.nan))
    return np.asarray(np.abs(partner_px - left_px), dtype=np.float32)
