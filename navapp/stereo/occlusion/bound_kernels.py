"""Compiled bound on filled disparities: an occluded pixel lies behind what occludes it."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Of `values.Origin`, as numbers for compiled code.
_UNKNOWN, _MATCHED, _INTERIOR = 0, 1, 3


@njit(cache=True, nogil=True)
def drop_beyond_bound(
    disparity: NDArray[np.float32],
    origin: NDArray[np.uint8],
    edge_px: np.float32,
    layer_px: np.float32,
) -> None:
    """Make unknown what is filled and nearer than its occlusion in the right view allows.

    A pixel at column x that is occluded by a surface of disparity d' at column x' > x has a
    disparity of at most d' - (x' - x). A filled pixel that agrees with the matches on both sides
    stays: it closes a hole in one surface. Mismatches are treated as occluded too: beside
    something near, the classes are unsure.

    Args:
        disparity: (h, w) px in place, matched and filled; NaN where unknown.
        origin: (h, w) of `values.Origin` in place. Nothing occludes a border occlusion.
        edge_px: by which a filled disparity may exceed the bound.
        layer_px: disparities further apart belong to different surfaces.
    """
    height, width = disparity.shape
    on_left = np.empty(width, np.float32)
    for y in range(height):
        nearest = np.float32(np.nan)
        for x in range(width):
            nearest = disparity[y, x] if origin[y, x] == _MATCHED else nearest
            on_left[x] = nearest
        nearest, most = np.float32(np.nan), np.float32(-np.inf)
        for x in range(width - 1, -1, -1):
            most -= np.float32(1.0)
            own = disparity[y, x]
            if origin[y, x] == _MATCHED:
                nearest, most = own, max(most, own)
            elif origin[y, x] >= _INTERIOR and own > most + edge_px:
                # Nothing differs from NaN: without a match on one side the other one decides.
                differs = abs(own - nearest) > layer_px or abs(own - on_left[x]) > layer_px
                if differs:
                    disparity[y, x], origin[y, x] = np.float32(np.nan), _UNKNOWN
