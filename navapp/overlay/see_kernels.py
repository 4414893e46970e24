"""Compiled look-up of the measured depth at the pixels of a picture that is not rectified."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Of `values.Origin`, as a number for compiled code.
_MATCHED = 1


class Measured(NamedTuple):
    """A map in the rectified left view, over its pixels or over squares of them."""

    disparity: NDArray[np.float32]  # (h, w) px of the map's own pixels, NaN where unknown
    origin: NDArray[np.uint8]  # (h, w) of `Origin`: what is not matched is a guess, or unknown
    # x, y: column and row of the map's first pixel, counted in its own pixels.
    x: int
    y: int
    halvings: int  # a pixel of the map covers 2 ** halvings of the view, each way


@njit(cache=True, nogil=True)
def look_up_depth(
    columns: NDArray[np.int16],
    rows: NDArray[np.int16],
    depth_share: NDArray[np.float32],
    first: tuple[int, int],
    focal_baseline: float,
    around: Measured,
    finer: Measured,
    is_in_front: NDArray[np.bool_],
    corner: tuple[int, int],
    depth_mm: NDArray[np.float32],
    is_guess: NDArray[np.uint8],
    in_front: NDArray[np.uint8],
) -> None:
    """What was measured at pixels of the rectified view.

    Args:
        columns: (H', W') nearest one of the rectified view, for each pixel of the picture.
        rows: (H', W') nearest one.
        depth_share: (H', W') depth in the picture's camera over rectified depth.
        first: column and row of the first pixel that is asked for.
        focal_baseline: px mm of the rectified pair.
        around: what lies around the bone.
        finer: what holds instead where it is matched.
        is_in_front: (H, W) marks of what hides the bone.
        corner: column and row of the marks' first pixel.
        depth_mm: (h, w) in place, NaN where unknown.
        is_guess: (h, w) in place, 1 where nothing is matched.
        in_front: (h, w) in place, 255 where it is marked.
    """
    scale, width = np.float32(focal_baseline), depth_mm.shape[1]
    for j in range(depth_mm.shape[0]):
        across = columns[j + first[1], first[0] : first[0] + width]
        down = rows[j + first[1], first[0] : first[0] + width]
        share = depth_share[j + first[1], first[0] : first[0] + width]
        for i in range(width):
            u, v = int(across[i]), int(down[i])
            x, y = u - corner[0], v - corner[1]
            mark, depth, guess = 0, np.float32(np.nan), 1
            # Beside the marks nothing is known.
            if 0 <= x < is_in_front.shape[1] and 0 <= y < is_in_front.shape[0]:
                mark = 255 if is_in_front[y, x] else 0
                disparity, is_matched = look_up(u, v, finer)
                if not is_matched:
                    disparity, is_matched = look_up(u, v, around)
                guess = 0 if is_matched else 1
                if disparity > 0.0:
                    depth = scale / disparity * share[i]
            depth_mm[j, i], is_guess[j, i], in_front[j, i] = depth, guess, mark


@njit(cache=True, nogil=True)
def look_up(u: int, v: int, given: Measured) -> tuple[np.float32, bool]:
    """Disparity in px of the view at one of its pixels, NaN where unknown, and whether matched."""
    x, y = (u >> given.halvings) - given.x, (v >> given.halvings) - given.y
    if x < 0 or y < 0 or x >= given.disparity.shape[1] or y >= given.disparity.shape[0]:
        return np.float32(np.nan), False
    is_matched = given.origin[y, x] == _MATCHED
    return np.float32(1 << given.halvings) * given.disparity[y, x], is_matched
