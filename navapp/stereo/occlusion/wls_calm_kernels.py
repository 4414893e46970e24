"""Compiled median of a filled map."""

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
    upright = np.full(width + 4, np.float32(np.nan))
    for y in range(first, height, step):
        above, below = max(y - 1, 0), min(y + 1, height - 1)
        _medians_of_rows(
            told, scene.classes, (max(y - 2, 0), above, y, below, min(y + 2, height - 1)),
            upright[2 : width + 2],
        )  # fmt: skip
        _medians_of_columns(upright, told[y], scene.classes[y], disparity[y])
        for x in range(width):
            label = scene.classes[y, x]
            filled = _UNKNOWN if np.isnan(told[y, x]) else label
            origin[y, x] = scene.origin[y, x] if label == 0 else filled


@njit(cache=True, nogil=True)
def _medians_of_rows(
    told: NDArray[np.float32],
    classes: NDArray[np.uint8],
    rows: tuple[int, int, int, int, int],
    medians: NDArray[np.float32],
) -> None:
    ya, yb, y, yd, ye = rows
    for x in range(len(medians)):
        v, own = told[y, x], classes[y, x]
        if own == 0:
            # Nobody asks: a neighbour of another class has no say.
            continue
        a = _vote(told[ya, x], classes[ya, x] == own, v)
        b = _vote(told[yb, x], classes[yb, x] == own, v)
        d = _vote(told[yd, x], classes[yd, x] == own, v)
        e = _vote(told[ye, x], classes[ye, x] == own, v)
        medians[x] = _median(a, b, v, d, e)


@njit(cache=True, nogil=True)
def _medians_of_columns(
    upright: NDArray[np.float32],
    told: NDArray[np.float32],
    classes: NDArray[np.uint8],
    calmed: NDArray[np.float32],
) -> None:
    last = len(calmed) - 1
    for x in range(len(calmed)):
        own = classes[x]
        if own == 0:
            calmed[x] = told[x]
            continue
        v = upright[x + 2]
        a = _vote(upright[x], classes[max(x - 2, 0)] == own, v)
        b = _vote(upright[x + 1], classes[max(x - 1, 0)] == own, v)
        d = _vote(upright[x + 3], classes[min(x + 1, last)] == own, v)
        e = _vote(upright[x + 4], classes[min(x + 2, last)] == own, v)
        calmed[x] = _median(a, b, v, d, e)


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
