"""Compiled occlusion filling: planes fitted to what may speak for short pieces of a row."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Of `values.Origin`, as numbers for compiled code.
_BORDER, _INTERIOR, _MISMATCH = 2, 3, 4
# Even a match without confidence tells something.
_LEAST_TRUST = 0.05
# A fitted slope may lead this far beyond what was measured.
_BEYOND_PX = 1.0
# One plane fills at most so many pixels of a row.
_PIECE_PX = 16
# Every so many-th pixel of the support is asked: neighbours tell nearly the same.
_STRIDE_PX = 3


class Scene(NamedTuple):
    """What is filled, (h, w) each."""

    disparity: NDArray[np.float32]  # px; read where matched
    classes: NDArray[np.uint8]  # of `occlusion.classify`
    is_support: NDArray[np.bool_]  # matches that stand
    picture: NDArray[np.uint8]  # grey
    confidence: NDArray[np.float32]


class Rules(NamedTuple):
    """How the fit works; see `FillSettings`."""

    radius_px: int
    rows: int  # of support above and below
    max_gap_px: int
    distance_px: float  # at which a pixel's weight is 1/e
    grey_scale: float
    layer_px: float
    layer_growth: float
    slope_penalty_px2: float


@njit(cache=True, nogil=True)
def fill_rows(scene: Scene, rules: Rules, first: int, step: int, told: NDArray[np.float32]) -> None:
    """Fill the classified pixels of rows `first`, `first + step`, ...

    Args:
        scene: what is filled.
        rules: of the fit.
        first: row.
        step: between rows.
        told: (h, w) in place: the disparity where something may speak for a classified pixel.
    """
    height, width = told.shape
    on_left, on_right = np.empty(width, np.int64), np.empty(width, np.int64)
    for y in range(first, height, step):
        _speakers(scene.is_support[y], scene.classes[y], rules.max_gap_px, on_left, on_right)
        begin = 0
        while begin < width:
            left, right = on_left[begin], on_right[begin]
            end = begin + 1
            while end < width and on_left[end] == left and on_right[end] == right:
                end += 1
            if left >= 0 or right >= 0:
                for x in range(begin, end, _PIECE_PX):
                    _fill_piece(scene, rules, y, (left, right), x, told[y, x:end][:_PIECE_PX])
            begin = end


@njit(cache=True, nogil=True)
def _speakers(
    is_support: NDArray[np.bool_],
    classes: NDArray[np.uint8],
    max_gap: int,
    on_left: NDArray[np.int64],
    on_right: NDArray[np.int64],
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
def _fill_piece(
    scene: Scene,
    rules: Rules,
    y: int,
    speakers: tuple[int, int],
    begin: int,
    piece: NDArray[np.float32],
) -> None:
    """Fill a few pixels from column `begin` on with one plane, of the farther speaker's layer.

    The plane stays within what was measured, and a little beyond.
    """
    centre = begin + 0.5 * (len(piece) - 1)
    layer, near, grey = np.inf, np.inf, 0.0
    for u in speakers:
        if u >= 0:
            layer, near = min(layer, scene.disparity[y, u]), min(near, abs(u - centre))
    for k in range(len(piece)):
        grey += scene.picture[y, begin + k] / len(piece)
    place = centre, y, layer, near, grey
    sums, low, high = np.zeros(9), np.inf, -np.inf
    up = rules.rows // _STRIDE_PX * _STRIDE_PX
    for v in range(y - up, y + up + 1, _STRIDE_PX):
        if 0 <= v < len(scene.disparity):
            for side in range(2):
                if speakers[side] >= 0:
                    ends = _add_support(scene, rules, v, speakers[side], 2 * side - 1, place, sums)
                    low, high = min(low, ends[0]), max(high, ends[1])
    if sums[0] == 0.0:
        piece[:] = layer
        return
    value, slope = _plane_of_row(sums / sums[0], rules.slope_penalty_px2)
    for k in range(len(piece)):
        d = value + slope * (begin + k - centre)
        piece[k] = layer + min(max(d, low - _BEYOND_PX), high + _BEYOND_PX)


@njit(cache=True, nogil=True)
def _add_support(
    scene: Scene,
    rules: Rules,
    v: int,
    first: int,
    outwards: int,
    place: tuple[float, int, float, float, float],
    sums: NDArray[np.float64],
) -> tuple[float, float]:
    """Add the normal equations of one side of a row of support; the range of its disparities.

    A weight falls with the difference in grey levels and with the distance, from the nearest
    speaker. Only what differs little from the layer speaks.
    """
    centre, y, layer, near, grey = place
    disparity, is_support = scene.disparity[v], scene.is_support[v]
    picture, confidence = scene.picture[v], scene.confidence[v]
    dy = float(v - y)
    low, high = np.inf, -np.inf
    inwards = min(int(abs(first - centre)), rules.radius_px) // _STRIDE_PX * _STRIDE_PX
    for k in range(-inwards, rules.radius_px + 1, _STRIDE_PX):
        u = first + outwards * k
        if not 0 <= u < len(disparity) or not is_support[u]:
            continue
        dx, d = u - centre, disparity[u] - layer
        if abs(d) >= rules.layer_px + rules.layer_growth * abs(dx):
            continue
        far = (np.sqrt(dx * dx + dy * dy) - near) / rules.distance_px
        far += abs(picture[u] - grey) / rules.grey_scale
        w = (max(confidence[u], 0.0) + _LEAST_TRUST) * np.exp(np.float32(-far))
        sums[0] += w
        sums[1] += w * dx
        sums[2] += w * dy
        sums[3] += w * d
        sums[4] += w * dx * dx
        sums[5] += w * dx * dy
        sums[6] += w * dy * dy
        sums[7] += w * dx * d
        sums[8] += w * dy * d
        low, high = min(low, d), max(high, d)
    return low, high


@njit(cache=True, nogil=True)
def _plane_of_row(means: NDArray[np.float64], slope_penalty: float) -> tuple[float, float]:
    """Value and slope along the row, at the piece's centre, of weighted means."""
    _, x, y, d, xx, xy, yy, xd, yd = means
    xx, xy, yy = xx - x * x + slope_penalty, xy - x * y, yy - y * y + slope_penalty
    xd, yd = xd - x * d, yd - y * d
    determinant = xx * yy - xy * xy
    slope_x, slope_y = (xd * yy - yd * xy) / determinant, (xx * yd - xy * xd) / determinant
    return d - slope_x * x - slope_y * y, slope_x
