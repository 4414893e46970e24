"""Compiled weighted fits of planes: who is asked, and up to eight pixels of a row together."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Even a match without confidence tells something.
_LEAST_TRUST = np.float32(0.05)
# A fitted slope may lead this far beyond what was measured.
_BEYOND_PX = np.float32(1.0)

# A place of the support: column, disparity, trust, grey value.
N_TOLD_OF_A_PLACE = 4
# That many pixels are fitted together. What belongs to each of them stands side by side in one
# array: where it is, what may speak for it, its normal equations, its support's range, the result.
_LANES = 8
_X, _LAYER, _NEAR, _FROM, _TO, _GREY = (_LANES * k for k in range(6))
_SW, _SX, _SY, _SXX, _SXY, _SYY = (_LANES * k for k in range(6, 12))
_SD, _SDX, _SDY, _LOW, _HIGH, _TOLD = (_LANES * k for k in range(12, 18))
N_STATE = 18 * _LANES
_NOTHING = np.float32(1e9)


class Scene(NamedTuple):
    """What is filled."""

    disparity: NDArray[np.float32]  # (h, w) px; read where matched
    origin: NDArray[np.uint8]  # (h, w) of the matches
    classes: NDArray[np.uint8]  # (h, w) of `occlusion.classify`
    is_support: NDArray[np.bool_]  # (h, w) matches that stand
    picture: NDArray[np.uint8]  # (h, w) grey
    confidence: NDArray[np.float32]  # (h, w)


class Rules(NamedTuple):
    """How the fit works; see `FillSettings`."""

    radius: int
    rows: int
    max_gap: int
    stride: int
    layer_px: np.float32
    layer_growth: np.float32
    slope_penalty_px2: np.float32
    per_grey: np.float32
    per_px: np.float32


class Support(NamedTuple):
    """The pixels that are asked, in every `stride`-th row."""

    # (h / stride, w, 4) ascending in the column, as many as `counts` says.
    places: NDArray[np.float32]
    counts: NDArray[np.int32]  # (h / stride, w + 1) how many of them are left of a column


@njit(cache=True, nogil=True)
def list_support(scene: Scene, stride: int, first: int, step: int, support: Support) -> None:
    """List every `stride`-th pixel of each run: neighbours tell nearly the same.

    Args:
        scene: what is filled.
        stride: between the listed rows, and between pixels of a run.
        first: listed row.
        step: between the listed rows to work on.
        support: in place.
    """
    width = scene.origin.shape[1]
    for row in range(first, support.counts.shape[0], step):
        y, n, run = row * stride, 0, 0
        is_support, picture = scene.is_support[y], scene.picture[y]
        confidence, disparity = scene.confidence[y], scene.disparity[y]
        places, counts = support.places[row], support.counts[row]
        for x in range(width):
            counts[x] = n
            if not is_support[x]:
                run = 0
                continue
            if run % stride == 0:
                trust = confidence[x] if confidence[x] > 0.0 else np.float32(0.0)
                places[n, 0], places[n, 1], places[n, 2] = x, disparity[x], trust + _LEAST_TRUST
                places[n, 3] = picture[x]
                n += 1
            run += 1
        counts[width] = n


@njit(cache=True, nogil=True)
def nearest(x: int, left: int, right: int) -> int:
    """Distance to the nearer of those who speak."""
    near = x - left if left >= 0 else right - x
    return min(near, right - x) if right >= 0 else near


@njit(cache=True, nogil=True)
def fit(
    scene: Scene,
    support: Support,
    rules: Rules,
    y: int,
    fitted: NDArray[np.int32],
    on_left: NDArray[np.int32],
    on_right: NDArray[np.int32],
    state: NDArray[np.float32],
    told: NDArray[np.float32],
) -> None:
    """Fit pixels of a row, up to `_LANES` neighbours together."""
    height = scene.disparity.shape[0]
    low_row = (max(y - rules.rows, 0) + rules.stride - 1) // rules.stride
    high_row = min(y + rules.rows, height - 1) // rules.stride
    disparity, picture = scene.disparity[y], scene.picture[y]
    done = 0
    while done < len(fitted):
        n, begin, end = _start(disparity, picture, rules, fitted[done:], on_left, on_right, state)
        for row in range(low_row, high_row + 1):
            dy = np.float32(row * rules.stride - y)
            among = support.counts[row, begin], support.counts[row, end + 1]
            _add_row(support.places[row], among, dy, rules, state)
        _planes_at_origin(state, rules.slope_penalty_px2)
        for k in range(n):
            told[fitted[done + k]] = state[_TOLD + k]
        done += n


@njit(cache=True, nogil=True)
def _start(
    disparity: NDArray[np.float32],
    picture: NDArray[np.uint8],
    rules: Rules,
    fitted: NDArray[np.int32],
    on_left: NDArray[np.int32],
    on_right: NDArray[np.int32],
    state: NDArray[np.float32],
) -> tuple[int, int, int]:
    """How many pixels are fitted together, and the first and last column of all their support.

    A pixel's layer is that of the farther of those who speak.
    """
    width = len(disparity)
    state[:] = 0.0
    begin, end, n = width, -1, 0
    while n < min(_LANES, len(fitted)):
        x = fitted[n]
        left, right = on_left[x], on_right[x]
        from_column = x if left < 0 else max(left - rules.radius, 0)
        to_column = x if right < 0 else min(right + rules.radius, width - 1)
        if n > 0 and from_column > end:
            break
        begin, end = min(begin, from_column), max(end, to_column)
        farther = right if left < 0 or (right >= 0 and disparity[right] < disparity[left]) else left
        state[_X + n], state[_LAYER + n] = x, disparity[farther]
        state[_FROM + n], state[_TO + n] = from_column, to_column
        state[_NEAR + n] = np.float32(nearest(x, left, right)) * rules.per_px
        state[_GREY + n] = picture[x]
        state[_LOW + n], state[_HIGH + n] = _NOTHING, -_NOTHING
        n += 1
    return n, begin, end


@njit(cache=True, nogil=True)
def _add_row(
    places: NDArray[np.float32],
    among: tuple[int, int],
    dy: np.float32,
    rules: Rules,
    state: NDArray[np.float32],
) -> None:
    """Add the support of one row to the normal equations of all lanes.

    The weight falls with the difference in grey levels and with distance, from the nearest that may
    speak; (1 - f / 64) ** 64 is exp(-f) but for its tail, where nothing weighs, and much faster. It
    stays above what float32 can hold.
    """
    zero, one, part = np.float32(0.0), np.float32(1.0), np.float32(1.0 / 64.0)
    least, per_grey, per_px = np.float32(0.3), rules.per_grey, rules.per_px
    layer_px, layer_growth = rules.layer_px, rules.layer_growth
    for i in range(among[0], among[1]):
        u, value, trust, grey = places[i, 0], places[i, 1], places[i, 2], places[i, 3]
        for k in range(_LANES):
            dx = u - state[_X + k]
            d = value - state[_LAYER + k]
            other = per_grey * abs(grey - state[_GREY + k])
            far = other + per_px * np.sqrt(dx * dx + dy * dy) - state[_NEAR + k]
            w = one - part * far
            w = w if w > least else least
            w = w * w
            w = w * w
            w = w * w
            w = w * w
            w = w * w
            w = trust * (w * w)
            is_of_layer = abs(d) < layer_px + layer_growth * abs(dx)
            speaks = is_of_layer & (u >= state[_FROM + k]) & (u <= state[_TO + k])
            w = w if speaks else zero
            wx, wy, wd = w * dx, w * dy, w * d
            state[_SW + k] += w
            state[_SX + k] += wx
            state[_SY + k] += wy
            state[_SD + k] += wd
            state[_SXX + k] += wx * dx
            state[_SXY + k] += wx * dy
            state[_SYY + k] += wy * dy
            state[_SDX + k] += wd * dx
            state[_SDY + k] += wd * dy
            low, high = state[_LOW + k], state[_HIGH + k]
            state[_LOW + k] = d if speaks & (d < low) else low
            state[_HIGH + k] = d if speaks & (d > high) else high


@njit(cache=True, nogil=True)
def _planes_at_origin(state: NDArray[np.float32], slope_penalty: np.float32) -> None:
    """The planes' values at their places, within what was measured and a little beyond.

    Where nobody was asked, the layer.
    """
    for k in range(_LANES):
        # A plain division would ask for zero every time, and be done lane by lane.
        share = np.reciprocal(state[_SW + k])
        mean_x, mean_y, mean = (
            state[_SX + k] * share,
            state[_SY + k] * share,
            state[_SD + k] * share,
        )
        xx = state[_SXX + k] * share - mean_x * mean_x + slope_penalty
        yy = state[_SYY + k] * share - mean_y * mean_y + slope_penalty
        xy = state[_SXY + k] * share - mean_x * mean_y
        dx = state[_SDX + k] * share - mean * mean_x
        dy = state[_SDY + k] * share - mean * mean_y
        per_det = np.reciprocal(xx * yy - xy * xy)
        slope_x, slope_y = (dx * yy - dy * xy) * per_det, (xx * dy - xy * dx) * per_det
        value = mean - slope_x * mean_x - slope_y * mean_y
        low, high = state[_LOW + k] - _BEYOND_PX, state[_HIGH + k] + _BEYOND_PX
        value = low if value < low else value
        value = high if value > high else value
        state[_TOLD + k] = state[_LAYER + k] + (value if state[_SW + k] > 0.0 else np.float32(0.0))
