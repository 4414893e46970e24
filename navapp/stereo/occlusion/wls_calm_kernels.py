"""Compiled median of a filled map."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.stereo.occlusion.wls_fit_kernels import Scene

# Of `values.Origin`, as a number for compiled code.
_UNKNOWN = 0


@njit(cache=True, nogil=True)
def calm_rows(
    scene: Scene,
    told: NDArray[np.float32],
    first: int,
    step: int,
    disparity: NDArray[np.float32],
    origin: NDArray[np.uint8],
) -> None:
    """Median of five rows, then of five columns, at every filled pixel: one outlier is not seen.

    A neighbour that is unknown or of another class counts as the pixel itself: what stands on the
    forbidden side has no say here either.

    Args:
        scene: what is filled.
        told: (h, w) of `between_rows`.
        first: row.
        step: between rows.
        disparity: (h, w) in place.
        origin: (h, w) in place: the class where a pixel is filled.
    """
    height, width = told.shape
    upright, labels = np.full(width + 4, np.float32(np.nan)), np.zeros(width + 4, np.uint8)
    for y in range(first, height, step):
        _medians(_rows_around(told, y), _rows_around(scene.classes, y), upright[2 : width + 2])
        labels[2 : width + 2], disparity[y] = scene.classes[y], told[y]
        _medians(_shifted(upright), _shifted(labels), disparity[y])
        for x in range(width):
            label = scene.classes[y, x]
            filled = _UNKNOWN if np.isnan(told[y, x]) else label
            origin[y, x] = scene.origin[y, x] if label == 0 else filled


@njit(cache=True, nogil=True)
def _rows_around(plane: NDArray[Any], y: int) -> tuple[NDArray[Any], ...]:
    """Row y of five in the middle; beyond the last row that again."""
    last = len(plane) - 1
    above, below = plane[max(y - 1, 0)], plane[min(y + 1, last)]
    return plane[max(y - 2, 0)], above, plane[y], below, plane[min(y + 2, last)]


@njit(cache=True, nogil=True)
def _shifted(row: NDArray[Any]) -> tuple[NDArray[Any], ...]:
    """The row (w + 4,) from five places on, (w,) each: pixels beside each other."""
    n = len(row)
    return row[: n - 4], row[1 : n - 3], row[2 : n - 2], row[3 : n - 1], row[4:]


@njit(cache=True, nogil=True)
def _medians(
    values: tuple[NDArray[np.float32], ...],
    labels: tuple[NDArray[np.uint8], ...],
    medians: NDArray[np.float32],
) -> None:
    """Medians (w,) of five, where the middle one is filled; those of its class vote."""
    first, second, third, fourth, fifth = values
    of_first, of_second, of_third, of_fourth, of_fifth = labels
    for x in range(len(medians)):
        v, own = third[x], of_third[x]
        if own == 0:
            # Nobody asks: a neighbour of another class has no say.
            continue
        a = _vote(first[x], of_first[x] == own, v)
        b = _vote(second[x], of_second[x] == own, v)
        d = _vote(fourth[x], of_fourth[x] == own, v)
        e = _vote(fifth[x], of_fifth[x] == own, v)
        medians[x] = _median(a, b, v, d, e)


@njit(cache=True, nogil=True)
def _vote(value: np.float32, may_vote: bool, own: np.float32) -> np.float32:
    return value if may_vote and not np.isnan(value) else own


@njit(cache=True, nogil=True)
def _smaller(a: np.float32, b: np.float32) -> np.float32:
    return a if a < b else b


@njit(cache=True, nogil=True)
def _larger(a: np.float32, b: np.float32) -> np.float32:
    return a if a > b else b


@njit(cache=True, nogil=True)
def _median(
    a: np.float32, b: np.float32, c: np.float32, d: np.float32, e: np.float32
) -> np.float32:
    low = _larger(_smaller(a, b), _smaller(d, e))
    high = _smaller(_larger(a, b), _larger(d, e))
    return np.float32(_larger(_smaller(low, high), _smaller(_larger(low, high), c)))
