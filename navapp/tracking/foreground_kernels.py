"""Compiled vote on which side of an edge a guess belongs to: a bilateral grid.

Source: Chen, Paris and Durand 2007 (bilateral grid), on marks instead of grey levels.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# A cell of the grid: pixels each way, and grey levels.
CELL_PX, CELL_GREY = 8, 16
# So many matched pixels around say something.
_LEAST_VOTES = 4.0


@njit(cache=True, nogil=True)
def vote_on_guesses(
    picture: NDArray[np.uint8],
    is_matched: NDArray[np.bool_],
    is_asked: NDArray[np.bool_],
    is_in_front: NDArray[np.bool_],
) -> None:
    """Mark guesses as what is matched around them and looks alike is marked.

    A cell counts with its neighbours in place and in grey level. Where few matched pixels say
    anything, a guess keeps its mark.

    Args:
        picture: (h, w) grey.
        is_matched: (h, w); only these vote.
        is_asked: (h, w) where marks mean something: on the bone and just beside it.
        is_in_front: (h, w) in place.
    """
    height, width = picture.shape
    rows, columns, levels = height // CELL_PX + 3, width // CELL_PX + 3, 256 // CELL_GREY + 2
    votes = np.zeros((rows, columns, levels, 2), dtype=np.float32)
    for y in range(height):
        for x in range(width):
            if is_matched[y, x] and is_asked[y, x]:
                cell = votes[y // CELL_PX + 1, x // CELL_PX + 1, picture[y, x] // CELL_GREY + 1]
                cell[1 if is_in_front[y, x] else 0] += np.float32(1.0)
    for y in range(height):
        for x in range(width):
            if is_matched[y, x] or not is_asked[y, x]:
                continue
            row, column = y // CELL_PX + 1, x // CELL_PX + 1
            level = picture[y, x] // CELL_GREY + 1
            bone, front = np.float32(0.0), np.float32(0.0)
            for r in range(row - 1, row + 2):
                for c in range(column - 1, column + 2):
                    for k in range(level - 1, level + 2):
                        bone += votes[r, c, k, 0]
                        front += votes[r, c, k, 1]
            if bone + front >= _LEAST_VOTES:
                is_in_front[y, x] |= front > bone
