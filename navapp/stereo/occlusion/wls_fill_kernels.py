"""Compiled occlusion filling: who may speak for a pixel, and what lies between fitted pixels.

Only what was measured speaks, so fitted rows are independent; the rows between them read those.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.stereo.occlusion.wls_fit_kernels import (
    N_STATE,
    Rules,
    Scene,
    Support,
    fit,
    nearest,
)

# Of `values.Origin`, as numbers for compiled code.
_BORDER, _INTERIOR, _MISMATCH = 2, 3, 4
# Far from what was measured a fit changes slowly: one fitted pixel every so many.
_GAP_PER_SPACING, _WIDEST_SPACING_PX = 2, 8
# Fitted rows that differ by less than this show the same surface.
_SAME_PX = np.float32(1.0)


@njit(cache=True, nogil=True)
def fill_rows(
    scene: Scene, support: Support, rules: Rules, first: int, step: int, told: NDArray[np.float32]
) -> None:
    """Fill rows `first`, `first + step`, ...: even ones by fits, odd ones as those beside them.

    An odd row is told what the even ones above and below say, and fitted where neither tells.

    Args:
        scene: what is filled.
        support: of it.
        rules: of the fit.
        first: row. Odd rows need the even ones beside them filled.
        step: between rows, even.
        told: (h, w) in place: the disparity where nothing is to be filled, the told value
            elsewhere; NaN where nothing may speak.
    """
    height, width = told.shape
    on_left, on_right = np.empty(width, np.int32), np.empty(width, np.int32)
    fitted, state = np.empty(width, np.int32), np.empty(N_STATE, np.float32)
    for y in range(first, height, step):
        _speakers(scene.is_support[y], scene.classes[y], rules.max_gap, on_left, on_right)
        _keep_matches(scene.disparity[y], scene.classes[y], told[y])
        if y % 2 == 1:
            _from_beside(scene, y, min(y + 1, height - 1), on_left, on_right, told)
        _fill_runs(scene, support, rules, y, on_left, on_right, fitted, state, told[y])


@njit(cache=True, nogil=True)
def _keep_matches(
    disparity: NDArray[np.float32], classes: NDArray[np.uint8], told: NDArray[np.float32]
) -> None:
    for x in range(len(told)):
        told[x] = disparity[x] if classes[x] == 0 else np.float32(np.nan)


@njit(cache=True, nogil=True)
def _from_beside(
    scene: Scene,
    y: int,
    next_y: int,
    on_left: NDArray[np.int32],
    on_right: NDArray[np.int32],
    told: NDArray[np.float32],
) -> None:
    """What the pixels of the same class above and below say; of two surfaces, the similar one.

    Nobody need speak any more for a pixel that is told.
    """
    above, below, own = told[y - 1], told[next_y], told[y]
    classes, above_classes, below_classes = (
        scene.classes[y], scene.classes[y - 1], scene.classes[next_y],
    )  # fmt: skip
    picture, above_picture, below_picture = (
        scene.picture[y], scene.picture[y - 1], scene.picture[next_y],
    )  # fmt: skip
    for x in range(len(own)):
        if on_left[x] < 0 and on_right[x] < 0:
            continue
        upper = above[x] if above_classes[x] == classes[x] else np.float32(np.nan)
        lower = below[x] if below_classes[x] == classes[x] and next_y > y else np.float32(np.nan)
        if np.isnan(upper) and np.isnan(lower):
            continue
        on_left[x] = on_right[x] = -1
        if np.isnan(upper) or np.isnan(lower):
            own[x] = lower if np.isnan(upper) else upper
        elif abs(upper - lower) < _SAME_PX:
            own[x] = np.float32(0.5) * (upper + lower)
        else:
            up = abs(np.int64(picture[x]) - np.int64(above_picture[x]))
            down = abs(np.int64(picture[x]) - np.int64(below_picture[x]))
            own[x] = upper if up < down else lower


@njit(cache=True, nogil=True)
def _speakers(
    is_support: NDArray[np.bool_],
    classes: NDArray[np.uint8],
    max_gap: int,
    on_left: NDArray[np.int32],
    on_right: NDArray[np.int32],
) -> None:
    """Columns of the nearest support that may speak for each pixel to fill of a row, or -1.

    Border occlusions are filled from the right, interior ones from the left, mismatches from both.
    """
    width = len(classes)
    near = -1
    for x in range(width):
        near = x if is_support[x] else near
        may_speak = near >= 0 and x - near <= max_gap and classes[x] >= _INTERIOR
        on_left[x] = near if may_speak else -1
    near = -1
    for x in range(width - 1, -1, -1):
        near = x if is_support[x] else near
        is_from_right = (classes[x] == _BORDER) | (classes[x] == _MISMATCH)
        on_right[x] = near if is_from_right and near >= 0 and near - x <= max_gap else -1


@njit(cache=True, nogil=True)
def _fill_runs(
    scene: Scene,
    support: Support,
    rules: Rules,
    y: int,
    on_left: NDArray[np.int32],
    on_right: NDArray[np.int32],
    fitted: NDArray[np.int32],
    state: NDArray[np.float32],
    told: NDArray[np.float32],
) -> None:
    """Fits and straight lines between them over every run of a row.

    A run is a stretch of pixels for which the same pixels speak. Its ends are fitted, and between
    them the sparser the further from what was measured.
    """
    n = 0
    begin = 0
    while begin < len(told):
        if on_left[begin] < 0 and on_right[begin] < 0:
            begin += 1
            continue
        end = _end_of_run(begin, on_left, on_right)
        x = begin
        while x < end - 1:
            fitted[n] = x
            n += 1
            near = nearest(x, on_left[x], on_right[x])
            x = min(x + min(1 + near // _GAP_PER_SPACING, _WIDEST_SPACING_PX), end - 1)
        fitted[n] = end - 1
        n += 1
        begin = end
    fit(scene, support, rules, y, fitted[:n], on_left, on_right, state, told)
    for k in range(n - 1):
        # Nobody speaks between two runs that do not touch.
        inside = fitted[k] + 1
        if inside < fitted[k + 1] and (on_left[inside] >= 0 or on_right[inside] >= 0):
            _draw_line(told, fitted[k], fitted[k + 1])


@njit(cache=True, nogil=True)
def _end_of_run(begin: int, on_left: NDArray[np.int32], on_right: NDArray[np.int32]) -> int:
    """Column after the last pixel for which the same pixels speak."""
    end = begin + 1
    while (
        end < len(on_left) and on_left[end] == on_left[begin] and on_right[end] == on_right[begin]
    ):
        end += 1
    return end


@njit(cache=True, nogil=True)
def _draw_line(row: NDArray[np.float32], begin: int, end: int) -> None:
    slope = (row[end] - row[begin]) / np.float32(end - begin)
    for x in range(begin + 1, end):
        row[x] = row[begin] + slope * np.float32(x - begin)
