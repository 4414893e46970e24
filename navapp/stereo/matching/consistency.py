"""Do the two views of a match agree?

Right pictures are addressed by `shift`: the left map's column 0 is the right map's column `shift`.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.regions import large_smooth_regions
from navapp.stereo.matching.consistency_kernels import partner_values

T = TypeVar("T", bound=np.generic)

# In float32, disparities below 2048 px that are a whole pixel apart can differ by 6e-5 px more.
_ROUNDED_PX = 1e-3


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


def speckle_free(
    disparity_px: NDArray[np.float32], least_px: int, max_step_px: float
) -> NDArray[np.bool_]:
    """(h, w) known pixels in a connected patch of at least `least_px` pixels.

    Neighbours (four of them) are connected when their disparities differ by up to `max_step_px`, or
    0.001 px more.
    """
    return large_smooth_regions(disparity_px, least_px, max_step_px + _ROUNDED_PX)


def agreement_share(agrees: NDArray[np.bool_], is_judged: NDArray[np.bool_]) -> float:
    """Share of the judged pixels whose views agree; NaN when none is judged.

    Exchanged pictures give a tiny share.
    """
    n_judged = np.count_nonzero(is_judged)
    return np.count_nonzero(agrees & is_judged) / n_judged if n_judged else float("nan")
