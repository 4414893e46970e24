"""Compiled occlusion filling: a weighted fit of a plane per occluded pixel."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

LEFT, RIGHT, BOTH = 1, 2, 3
# A fitted slope may lead this far beyond what was measured.
_BEYOND_PX = 1.0

# Normal equations of a plane: weight, moments, right sides; then the disparities' range.
_W, _X, _Y, _XX, _XY, _YY, _D, _DX, _DY, _LOW, _HIGH = range(11)
_N_SUMS = 11


@njit(cache=True, nogil=True)
def fill_rows(
    disparity: NDArray[np.float32],
    matched: NDArray[np.bool_],
    picture: NDArray[np.int16],
    trust: NDArray[np.float32],
    sides: NDArray[np.uint8],
    colour_weight: NDArray[np.float32],
    distance_weight: NDArray[np.float32],
    numbers: NDArray[np.float64],
    first: int,
    last: int,
    filled: NDArray[np.float32],
) -> None:
    """Fill rows `first` to `last` (exclusive).

    Args:
        disparity: (h, w) px; read where matched.
        matched: (h, w).
        picture: (h, w, 3).
        trust: (h, w) weight of a matched pixel.
        sides: (h, w) 0 for pixels to leave, else which side may speak: 1 left, 2 right, 3 both.
        colour_weight: (766,) over the sum of the three absolute differences.
        distance_weight: (rows + 1, w) over |dy| and |dx|.
        numbers: radius px, largest gap px, layer half width px, its growth per px, slope penalty
            px^2, stride px (neighbours tell nearly the same: not every pixel is asked).
        first: row.
        last: row after the last.
        filled: (3, h, w) in place: value, then the lowest and highest value that may be told; NaN
            where nothing can speak.
    """
    width = disparity.shape[1]
    on_left = np.empty(width, np.int64)
    on_right = np.empty(width, np.int64)
    sums = np.empty(_N_SUMS)
    for y in range(first, last):
        _nearest_matched(matched[y], on_left, on_right)
        for x in range(width):
            side = sides[y, x]
            if side == 0:
                continue
            left = on_left[x] if side & LEFT else -1
            right = on_right[x] if side & RIGHT else -1
            if left >= 0 and x - left > numbers[1]:
                left = -1
            if right >= 0 and right - x > numbers[1]:
                right = -1
            if left < 0 and right < 0:
                filled[:, y, x] = np.nan
                continue
            if left < 0 or (right >= 0 and disparity[y, right] < disparity[y, left]):
                layer = disparity[y, right]
            else:
                layer = disparity[y, left]
            begin = x if left < 0 else left - int(numbers[0])
            end = x if right < 0 else right + int(numbers[0])
            columns = (max(begin, 0), min(end, width - 1))
            _gather(
                disparity, matched, picture, trust, colour_weight, distance_weight, numbers,
                (y, x), columns, layer, sums,
            )  # fmt: skip
            _plane_at_origin(sums, numbers[4], layer, filled[:, y, x])


@njit(cache=True, nogil=True)
def _nearest_matched(
    matched: NDArray[np.bool_], on_left: NDArray[np.int64], on_right: NDArray[np.int64]
) -> None:
    """Column of the nearest matched pixel at or left of (right of) each pixel of a row, or -1."""
    width = matched.shape[0]
    near = -1
    for x in range(width):
        if matched[x]:
            near = x
        on_left[x] = near
    near = -1
    for x in range(width - 1, -1, -1):
        if matched[x]:
            near = x
        on_right[x] = near


@njit(cache=True, nogil=True)
def _gather(
    disparity: NDArray[np.float32],
    matched: NDArray[np.bool_],
    picture: NDArray[np.int16],
    trust: NDArray[np.float32],
    colour_weight: NDArray[np.float32],
    distance_weight: NDArray[np.float32],
    numbers: NDArray[np.float64],
    place: tuple[int, int],
    columns: tuple[int, int],
    layer: np.float32,
    sums: NDArray[np.float64],
) -> None:
    """Normal equations of the layer's matched pixels between two columns, about a place.

    Disparities count from the layer's.
    """
    y, x = place
    half_width, growth, stride = numbers[2], numbers[3], int(numbers[5])
    rows = distance_weight.shape[0] - 1
    red, green, blue = picture[y, x, 0], picture[y, x, 1], picture[y, x, 2]
    total = s_x = s_y = s_xx = s_xy = s_yy = s_d = s_dx = s_dy = 0.0
    low, high = np.inf, -np.inf
    for v in range(
        max((y - rows) % stride, y - rows), min(disparity.shape[0], y + rows + 1), stride
    ):
        dy = v - y
        near = distance_weight[abs(dy)]
        for u in range(columns[0], columns[1] + 1, stride):
            if not matched[v, u]:
                continue
            dx = u - x
            d = disparity[v, u] - layer
            if abs(d) >= half_width + growth * abs(dx):
                continue
            colour = (
                abs(picture[v, u, 0] - red)
                + abs(picture[v, u, 1] - green)
                + abs(picture[v, u, 2] - blue)
            )
            weight = trust[v, u] * colour_weight[colour] * near[abs(dx)]
            total += weight
            w_x, w_y, w_d = weight * dx, weight * dy, weight * d
            s_x += w_x
            s_y += w_y
            s_d += w_d
            s_xx += w_x * dx
            s_xy += w_x * dy
            s_yy += w_y * dy
            s_dx += w_d * dx
            s_dy += w_d * dy
            low = min(low, d)
            high = max(high, d)
    sums[_W], sums[_X], sums[_Y], sums[_D] = total, s_x, s_y, s_d
    sums[_XX], sums[_XY], sums[_YY] = s_xx, s_xy, s_yy
    sums[_DX], sums[_DY] = s_dx, s_dy
    sums[_LOW], sums[_HIGH] = low, high


@njit(cache=True, nogil=True)
def _plane_at_origin(
    sums: NDArray[np.float64],
    slope_penalty: float,
    layer: np.float32,
    told: NDArray[np.float32],
) -> None:
    """The plane's value at the place, and the limits of what may be told there."""
    total = sums[_W]
    if total <= 0.0:
        told[:] = np.nan
        return
    mean_x, mean_y, mean = sums[_X] / total, sums[_Y] / total, sums[_D] / total
    xx = sums[_XX] / total - mean_x * mean_x + slope_penalty
    yy = sums[_YY] / total - mean_y * mean_y + slope_penalty
    xy = sums[_XY] / total - mean_x * mean_y
    dx, dy = sums[_DX] / total - mean * mean_x, sums[_DY] / total - mean * mean_y
    det = xx * yy - xy * xy
    slope_x, slope_y = (dx * yy - dy * xy) / det, (xx * dy - xy * dx) / det
    offset = mean - slope_x * mean_x - slope_y * mean_y
    low, high = sums[_LOW] - _BEYOND_PX, sums[_HIGH] + _BEYOND_PX
    told[0] = layer + min(max(offset, low), high)
    told[1] = layer + low
    told[2] = layer + high


@njit(cache=True, nogil=True)
def calm_rows(
    disparity: NDArray[np.float32],
    filled: NDArray[np.float32],
    sides: NDArray[np.uint8],
    first: int,
    last: int,
    calmed: NDArray[np.float32],
) -> None:
    """Median of the 5 x 5 known values around each filled pixel, within what may be told there.

    Args:
        disparity: (h, w) px, matched and filled; NaN where unknown.
        filled: (3, h, w) of `fill_rows`.
        sides: (h, w) as of `fill_rows`.
        first: row.
        last: row after the last.
        calmed: (h, w) in place where a pixel was filled.
    """
    height, width = disparity.shape
    near = np.empty(25, np.float32)
    for y in range(first, last):
        for x in range(width):
            if sides[y, x] == 0 or np.isnan(disparity[y, x]):
                continue
            n = 0
            for v in range(max(y - 2, 0), min(y + 3, height)):
                for u in range(max(x - 2, 0), min(x + 3, width)):
                    value = disparity[v, u]
                    if np.isnan(value):
                        continue
                    i = n
                    while i > 0 and near[i - 1] > value:
                        near[i] = near[i - 1]
                        i -= 1
                    near[i] = value
                    n += 1
            median = near[n // 2]
            calmed[y, x] = min(max(median, filled[1, y, x]), filled[2, y, x])
