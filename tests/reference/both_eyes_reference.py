"""What the right eye sees of a left view, in plain numpy."""

import numpy as np
from scipy.ndimage import binary_dilation

JUMP_PX = 1.5


def warped(depth, first_column, scale_px_mm, width, first_warped):
    """(h, width) the left buffer as the right eye sees it, each pixel two pixels wide."""
    answer = np.full((len(depth), width), np.inf)
    rows, columns = np.nonzero(depth > 0.0)
    z = depth[rows, columns]
    at = columns + first_column - scale_px_mm / z - first_warped
    for side in range(2):
        column = np.floor(at).astype(int) + side
        inside = (column >= 0) & (column < width)
        np.minimum.at(answer, (rows[inside], column[inside]), z[inside])
    return np.where(np.isinf(answer), np.nan, answer)


def unclear(disparity_px, reach_px):
    """(h, w) hidden from the right eye, or near an outline in either picture."""
    outline = np.zeros(disparity_px.shape, dtype=bool)
    around = np.pad(disparity_px, 1, mode="edge")
    for rows, columns in ((1, 0), (1, 2), (0, 1), (2, 1)):
        beside = around[rows:, columns:][: len(disparity_px), : disparity_px.shape[1]]
        outline |= np.isfinite(disparity_px) & ~(np.abs(beside - disparity_px) <= JUMP_PX)
    near = binary_dilation(outline, np.ones((2 * reach_px + 1,) * 2))
    return near | np.array([_unclear_to_right_eye(row, reach_px) for row in disparity_px])


def _unclear_to_right_eye(row_px, reach_px):
    column = np.arange(len(row_px)) - row_px
    hidden = np.array([(column[x + 1 :] <= column[x]).any() for x in range(len(row_px))])
    answer = hidden.copy()
    for x in np.flatnonzero(np.isfinite(row_px) & ~hidden):
        # The nearest pixel, this one or further left, at which a surface begins.
        first = x
        while first > 0 and not hidden[first - 1]:
            if not abs(row_px[first] - row_px[first - 1]) <= JUMP_PX:
                break
            first -= 1
        answer[x] |= first > 0 and column[x] - column[first] < reach_px
    return answer
