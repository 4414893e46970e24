"""Compiled rule for guesses in gaps: what contradicts the reason why it is a gap."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Of `values.Origin`, as numbers for compiled code.
_MATCHED, _INTERIOR = 1, 3


@njit(cache=True, nogil=True)
def mark_impossible(
    disparity: NDArray[np.float32],
    origin: NDArray[np.uint8],
    edge_px: np.float32,
    layer_px: np.float32,
    is_impossible: NDArray[np.bool_],
) -> None:
    """Mark guesses that are too near for pixels that something hides from the right camera.

    Hidden at column x by a surface of disparity d' at column x' > x, a pixel has a disparity of at
    most d' - (x' - x). A guess that agrees with the matches on both sides is kept all the same: it
    closes a hole in one surface. Mismatches are asked too: beside something near, what the right
    camera sees is not known well enough to tell them from what is hidden.

    Args:
        disparity: (h, w) px, matched and filled; NaN where unknown.
        origin: (h, w) of `values.Origin`. Border occlusions are hidden by nothing.
        edge_px: by which a guess may exceed that bound.
        layer_px: by which surfaces differ.
        is_impossible: (h, w) in place.
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
            guess = disparity[y, x]
            is_impossible[y, x] = False
            if origin[y, x] == _MATCHED:
                nearest, most = guess, max(most, guess)
            elif origin[y, x] >= _INTERIOR and guess > most + edge_px:
                # Nothing differs from NaN: without a match on one side the other one decides.
                differs = abs(guess - nearest) > layer_px or abs(guess - on_left[x]) > layer_px
                is_impossible[y, x] = differs
