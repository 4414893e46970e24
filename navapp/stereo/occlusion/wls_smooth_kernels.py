"""Compiled fast global smoother: tridiagonal solves along rows and columns.

Memory runs along the rows, so columns are solved side by side, and rows are turned into columns
first.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Of `values.Origin`, as a number for compiled code.
_MATCHED = 1
# Pixels that were filled, or matched without confidence, follow their neighbours.
_LEAST_TRUST = np.float32(0.02)

# A matched pixel moves by no more than this share of its sigma. All of them lean the same way on a
# slanted surface: by a whole sigma the surface would tilt.
_REACH = np.float32(0.3)


class Lines(NamedTuple):
    """Columns to smooth."""

    values: NDArray[np.float32]  # (n, m) f before, u after; finite everywhere
    trust: NDArray[np.float32]  # (n, m) c, above 0
    links: NDArray[np.float32]  # (n, m) g between a pixel and the next of its column


class Measured(NamedTuple):
    """A disparity map with its confidence, all (h, w)."""

    disparity: NDArray[np.float32]
    sigma: NDArray[np.float32]
    origin: NDArray[np.uint8]
    confidence: NDArray[np.float32]


@njit(cache=True, nogil=True)
def weigh_rows(
    measured: Measured,
    centre: np.float32,
    first: int,
    last: int,
    values: NDArray[np.float32],
    trust: NDArray[np.float32],
) -> None:
    """What the solves start from.

    Args:
        measured: disparity NaN where unknown.
        centre: taken off, so that float32 keeps its digits.
        first: row.
        last: row after the last.
        values: (h, w) in place; 0 where unknown.
        trust: (h, w) in place; 1 where unknown, because nothing is linked to such a pixel.
    """
    for y in range(first, last):
        disparity, confidence = measured.disparity[y], measured.confidence[y]
        origin, row, row_trust = measured.origin[y], values[y], trust[y]
        for x in range(len(row)):
            c = confidence[x] if origin[x] == _MATCHED else np.float32(0.0)
            c = c if c > _LEAST_TRUST else _LEAST_TRUST
            is_unknown = np.isnan(disparity[x])
            row[x] = np.float32(0.0) if is_unknown else disparity[x] - centre
            row_trust[x] = np.float32(1.0) if is_unknown else c


@njit(cache=True, nogil=True)
def link_rows(
    disparity: NDArray[np.float32],
    picture: NDArray[np.uint8],
    link_weight: NDArray[np.float32],
    first: int,
    last: int,
    across: NDArray[np.float32],
    down: NDArray[np.float32],
) -> None:
    """How strongly neighbours are linked: 0 beside unknown pixels and beyond the map.

    Args:
        disparity: (h, w) NaN where unknown.
        picture: (h, w, channels).
        link_weight: g over the sum of the absolute differences of the channels.
        first: row.
        last: row after the last.
        across: (h, w) in place: to the pixel on the right.
        down: (h, w) in place: to the pixel below.
    """
    height, width = disparity.shape
    steps = np.empty(width, np.int32)
    for y in range(first, last):
        below = min(y + 1, height - 1)
        _steps(picture[y], picture[below], steps)
        _link(disparity[y], disparity[below], steps, link_weight, down[y])
        _steps(picture[y, : width - 1], picture[y, 1:], steps[: width - 1])
        _link(disparity[y, : width - 1], disparity[y, 1:], steps, link_weight, across[y])
        across[y, width - 1] = 0.0
    if last == height:
        down[height - 1] = 0.0


@njit(cache=True, nogil=True)
def _steps(picture: NDArray[np.uint8], other: NDArray[np.uint8], steps: NDArray[np.int32]) -> None:
    """Sum of the absolute differences of the channels."""
    for x in range(len(steps)):
        steps[x] = 0
    for c in range(picture.shape[1]):
        for x in range(len(steps)):
            steps[x] += abs(np.int32(picture[x, c]) - np.int32(other[x, c]))


@njit(cache=True, nogil=True)
def _link(
    disparity: NDArray[np.float32],
    other: NDArray[np.float32],
    steps: NDArray[np.int32],
    link_weight: NDArray[np.float32],
    links: NDArray[np.float32],
) -> None:
    for x in range(len(disparity)):
        is_known = (not np.isnan(disparity[x])) & (not np.isnan(other[x]))
        weight = link_weight[steps[x]]
        links[x] = weight if is_known else np.float32(0.0)


@njit(cache=True, nogil=True)
def solve_columns(lines: Lines, strength: np.float32, first: int, last: int) -> None:
    """Smooth every column of `first` to `last` (exclusive) along itself.

    Minimises sum c (u - f)^2 + strength * sum g (u_y - u_y+1)^2: one Thomas solve per column.
    """
    length = lines.values.shape[0]
    own_share = np.zeros((length, last - first), dtype=np.float32)
    no_links = np.zeros(last - first, dtype=np.float32)
    for y in range(length):
        before = lines.links[y - 1, first:last] if y > 0 else no_links
        above = max(y - 1, 0)
        _eliminate(
            lines.trust[y, first:last], lines.links[y, first:last], before, strength,
            own_share[above], own_share[y],
            lines.values[above, first:last], lines.values[y, first:last],
        )  # fmt: skip
    for y in range(length - 2, -1, -1):
        _substitute(own_share[y], lines.values[y + 1, first:last], lines.values[y, first:last])


@njit(cache=True, nogil=True)
def _eliminate(
    trust: NDArray[np.float32],
    links: NDArray[np.float32],
    links_before: NDArray[np.float32],
    strength: np.float32,
    share_before: NDArray[np.float32],
    share: NDArray[np.float32],
    values_before: NDArray[np.float32],
    values: NDArray[np.float32],
) -> None:
    """One row of the forward sweep of all columns.

    What a value takes from the next one is 1 minus its own share; the share is carried, because
    the usual pivot is a difference of large numbers where trust is small.
    """
    for k in range(len(values)):
        before = strength * links_before[k]
        own = trust[k] + before * share_before[k]
        # A plain division would ask for zero every time, and be done pixel by pixel.
        scale = np.reciprocal(own + strength * links[k])
        share[k] = own * scale
        values[k] = (trust[k] * values[k] + before * values_before[k]) * scale


@njit(cache=True, nogil=True)
def _substitute(
    share: NDArray[np.float32], values_after: NDArray[np.float32], values: NDArray[np.float32]
) -> None:
    """One row of the backward sweep of all columns."""
    for k in range(len(values)):
        values[k] += (np.float32(1.0) - share[k]) * values_after[k]


@njit(cache=True, nogil=True)
def bound_rows(
    measured: Measured,
    smooth: NDArray[np.float32],
    centre: np.float32,
    first: int,
    last: int,
    bounded: NDArray[np.float32],
) -> None:
    """The smoothed map: matched pixels within a part of their sigma, unknown ones NaN.

    Args:
        measured: before the smoothing.
        smooth: (h, w) values after the solves.
        centre: that was taken off.
        first: row.
        last: row after the last.
        bounded: (h, w) in place.
    """
    for y in range(first, last):
        disparity, sigma, origin = measured.disparity[y], measured.sigma[y], measured.origin[y]
        row, row_smooth = bounded[y], smooth[y]
        for x in range(len(row)):
            own, value = disparity[x], row_smooth[x] + centre
            reach = np.float32(0.0) if np.isnan(sigma[x]) else _REACH * sigma[x]
            low, high = own - reach, own + reach
            limited = low if value < low else value
            limited = high if limited > high else limited
            limited = limited if origin[x] == _MATCHED else value
            row[x] = own if np.isnan(own) else limited
