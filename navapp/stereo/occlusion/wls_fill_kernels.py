"""Compiled occlusion filling: planes fitted for short pieces of a row."""

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
# One plane fills at most so many pixels of a row, whose grey levels are alike.
_PIECE_PX, _ALIKE_GREY = 16, 30
# Every so many-th column and row of the support is asked: neighbours tell nearly the same.
STRIDE_PX = 3


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
    n_rows: int  # of support above and below, `STRIDE_PX` apart
    max_gap_px: int
    distance_px: float  # at which a pixel's weight is 1/e
    grey_scale: float
    layer_px: float
    layer_growth: float
    slope_penalty_px2: float


class Piece(NamedTuple):
    """Neighbouring pixels of a row, alike in grey, that are filled from the same matches."""

    row: int
    middle: float  # column
    grey: float  # mean
    disparity_px: float  # of the farther one of the matches
    neighbour_px: float  # distance of that match from the middle


@njit(cache=True, nogil=True)
def fill_rows(scene: Scene, rules: Rules, first: int, step: int, told: NDArray[np.float32]) -> None:
    """Fill the classified pixels of rows `first`, `first + step`, ...

    Args:
        scene: what is filled.
        rules: of the fit.
        first: row.
        step: between rows.
        told: (h, w) in place: the disparity of a classified pixel that a match may fill.
    """
    height, width = told.shape
    on_left, on_right = np.empty(width, np.int64), np.empty(width, np.int64)
    sums = np.empty(9)  # room for each piece in turn
    for y in range(first, height, step):
        _find_neighbours(scene.is_support[y], scene.classes[y], rules.max_gap_px, on_left, on_right)
        begin = 0
        while begin < width:
            end = begin + 1
            if on_left[begin] >= 0 or on_right[begin] >= 0:
                end = _find_end(scene.picture[y], begin, on_left, on_right)
                neighbours = on_left[begin], on_right[begin]
                _fill_piece(scene, rules, y, neighbours, begin, sums, told[y, begin:end])
            begin = end


@njit(cache=True, nogil=True)
def _find_neighbours(
    is_support: NDArray[np.bool_],
    classes: NDArray[np.uint8],
    max_gap_px: int,
    on_left: NDArray[np.int64],
    on_right: NDArray[np.int64],
) -> None:
    """Columns of the nearest matches from which each pixel of a row may be filled, or -1.

    Border occlusions are filled from the right, interior ones from the left, mismatches from both.
    """
    width = len(classes)
    near = -1
    for x in range(width):
        near = x if is_support[x] else near
        is_from_left = classes[x] == _INTERIOR or classes[x] == _MISMATCH
        on_left[x] = near if is_from_left and near >= 0 and x - near <= max_gap_px else -1
    near = -1
    for x in range(width - 1, -1, -1):
        near = x if is_support[x] else near
        is_from_right = classes[x] == _BORDER or classes[x] == _MISMATCH
        on_right[x] = near if is_from_right and near >= 0 and near - x <= max_gap_px else -1


@njit(cache=True, nogil=True)
def _find_end(
    grey: NDArray[np.uint8], begin: int, on_left: NDArray[np.int64], on_right: NDArray[np.int64]
) -> int:
    """Column after the last pixel of the piece that begins there."""
    end = begin + 1
    while (
        end < min(begin + _PIECE_PX, len(grey))
        and on_left[end] == on_left[begin]
        and on_right[end] == on_right[begin]
        and abs(float(grey[end]) - float(grey[begin])) <= _ALIKE_GREY
    ):
        end += 1
    return end


@njit(cache=True, nogil=True)
def _fill_piece(
    scene: Scene,
    rules: Rules,
    y: int,
    neighbours: tuple[int, int],
    begin: int,
    sums: NDArray[np.float64],
    filled: NDArray[np.float32],
) -> None:
    """Fill a piece, from column `begin` on, with one plane through the farther match's layer.

    The plane stays within what was measured, and a little beyond. `sums` is room for 9 numbers.
    """
    middle = begin + 0.5 * (len(filled) - 1)
    grey = scene.picture[y, begin : begin + len(filled)].mean()
    disparity_px, neighbour_px = np.inf, 0.0
    for u in neighbours:
        if u >= 0 and scene.disparity[y, u] < disparity_px:
            disparity_px, neighbour_px = scene.disparity[y, u], abs(u - middle)
    piece = Piece(y, middle, grey, disparity_px, neighbour_px)
    low, high = np.inf, -np.inf
    sums[:] = 0.0
    for row in range(-rules.n_rows, rules.n_rows + 1):
        v = y + row * STRIDE_PX
        if 0 <= v < len(scene.disparity):
            for u, outwards in ((neighbours[0], -1), (neighbours[1], 1)):
                if u >= 0:
                    ends = _add_support(scene, rules, piece, v, u, outwards, sums)
                    low, high = min(low, ends[0]), max(high, ends[1])
    sums /= sums[0]  # means from here on
    value, slope = _fit_plane(sums, rules.slope_penalty_px2)
    for k in range(len(filled)):
        d = value + slope * (begin + k - middle)
        filled[k] = disparity_px + min(max(d, low - _BEYOND_PX), high + _BEYOND_PX)


@njit(cache=True, nogil=True, forceinline=True)
def _add_support(
    scene: Scene,
    rules: Rules,
    piece: Piece,
    v: int,
    column: int,
    outwards: int,
    sums: NDArray[np.float64],
) -> tuple[float, float]:
    """Add one side of row `v` to the sums; the least and the largest difference from the layer.

    That is the support around a neighbour's column, on the piece's side up to its middle, as far as
    it differs little from the layer. A weight falls with the difference in grey levels, and with
    the distance, counted from that of the match whose layer it is. Sums as of `_fit_plane`.
    """
    disparity, is_support = scene.disparity[v], scene.is_support[v]
    picture, confidence = scene.picture[v], scene.confidence[v]
    dy = float(v - piece.row)
    low, high = np.inf, -np.inf
    inwards = min(int(abs(column - piece.middle) - 0.5), rules.radius_px) // STRIDE_PX * STRIDE_PX
    for k in range(-inwards, rules.radius_px + 1, STRIDE_PX):
        u = column + outwards * k
        if not 0 <= u < len(disparity) or not is_support[u]:
            continue
        dx, d = u - piece.middle, disparity[u] - piece.disparity_px
        if abs(d) >= rules.layer_px + rules.layer_growth * abs(dx):
            continue
        exponent = (np.sqrt(dx * dx + dy * dy) - piece.neighbour_px) / rules.distance_px
        exponent += abs(picture[u] - piece.grey) / rules.grey_scale
        trust = confidence[u] if confidence[u] > 0.0 else 0.0
        w = (trust + _LEAST_TRUST) * np.exp(-exponent)
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
def _fit_plane(means: NDArray[np.float64], slope_penalty: float) -> tuple[float, float]:
    """Value and slope along the row, at the piece's middle, by weighted means.

    Those of 1, x, y, d, xx, xy, yy, xd, yd: x and y from the piece's middle, d from its layer.
    """
    _, x, y, d, xx, xy, yy, xd, yd = means
    xx, xy, yy = xx - x * x + slope_penalty, xy - x * y, yy - y * y + slope_penalty
    xd, yd = xd - x * d, yd - y * d
    determinant = xx * yy - xy * xy
    slope_x, slope_y = (xd * yy - yd * xy) / determinant, (xx * yd - xy * xd) / determinant
    return d - slope_x * x - slope_y * y, slope_x
