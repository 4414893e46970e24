"""Masks of pictures: values under them, and their connected regions."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.region_kernels import (
    find_runs,
    find_smooth_runs,
    join_runs,
    join_smooth_runs,
    keep_large,
)

IntArray = NDArray[np.int32]

# Most masks have few runs; one with more is gone through twice.
_FEW_RUNS = 4096
_ROUNDED = 1e-3


def where(mask: NDArray[np.bool_], values: NDArray[Any], elsewhere: Any) -> NDArray[Any]:
    """As `np.where`, of the values' own type: numpy asks pixel by pixel, OpenCV copies vectors.

    Args:
        mask: (h, w).
        values: (h, w).
        elsewhere: (h, w), or a number.
    """
    import cv2

    answer = np.empty(values.shape, dtype=values.dtype)
    answer[...] = elsewhere
    if values.size:
        cv2.copyTo(values, mask.view(np.uint8), answer)
    return answer


def where_all(
    mask: NDArray[np.bool_], pictures: Iterable[tuple[NDArray[Any], Any]]
) -> list[NDArray[Any]]:
    """As `where`, of several pictures, each with what stands beside the mask."""
    return [where(mask, values, elsewhere) for values, elsewhere in pictures]


def grow(mask: NDArray[np.bool_], px: int) -> NDArray[np.bool_]:
    """A mask (h, w) with what lies so near to it, in columns and in rows."""
    import cv2

    size = 2 * px + 1
    return np.asarray(cv2.dilate(mask.view(np.uint8), np.ones((size, size), np.uint8)) > 0)


def shrink(mask: NDArray[np.bool_], px: int) -> NDArray[np.bool_]:
    """A mask (h, w) without its rim so wide; beside the picture nothing is of the mask."""
    import cv2

    size = 2 * px + 1
    square = np.ones((size, size), np.uint8)
    return np.asarray(cv2.erode(mask.view(np.uint8), square, borderValue=0) > 0)


def large_regions(
    mask: NDArray[np.bool_], least_px2: int, connectivity: int = 8
) -> NDArray[np.bool_]:
    """A mask (h, w) without its connected regions of fewer pixels; 4 or 8 neighbours connect."""
    is_large = np.zeros(mask.shape, dtype=np.bool_)
    mark_large(mask.view(np.uint8), (1,), least_px2, is_large, connectivity)
    return is_large


def mark_large(
    values: NDArray[np.uint8],
    kinds: Iterable[int],
    least_px2: int,
    is_large: NDArray[np.bool_],
    connectivity: int = 8,
) -> int:
    """Mark the large connected regions of each of some kinds of pixels.

    Args:
        values: (h, w).
        kinds: bits of each kind: a pixel is of it that has one of them.
        least_px2: pixels of a large region.
        is_large: (h, w) in place; only set to True.
        connectivity: 4 or 8 neighbours connect.

    Returns:
        Pixels of large regions.
    """
    n_large = 0
    for bits in kinds:
        runs, ends, parent = _all_runs(len(values), partial(find_runs, values, bits))
        join_runs(runs, ends, 1 if connectivity == 8 else 0, parent)
        n_large += int(keep_large(runs, ends, parent, least_px2, is_large))
    return n_large


def large_smooth_regions(
    values: NDArray[np.float32], least_px2: int, max_step: float
) -> NDArray[np.bool_]:
    """Pixels (h, w) of the regions of at least so many that are known and go on smoothly.

    Args:
        values: (h, w), NaN where unknown; nothing is connected to an infinite one.
        least_px2: pixels of a large region.
        max_step: neighbours (four) are connected when they differ by no more than this and 0.001:
            in float32, whole numbers below 2048 that differ by 1 can differ by 6e-5 more.
    """
    is_large = np.zeros(values.shape, dtype=np.bool_)
    values = np.ascontiguousarray(values, dtype=np.float32)
    step = np.float32(max_step + _ROUNDED)
    runs, ends, parent = _all_runs(len(values), partial(find_smooth_runs, values, step))
    join_smooth_runs(values, step, runs, ends, parent)
    keep_large(runs, ends, parent, least_px2, is_large)
    return is_large


def _all_runs(
    height: int, find: Callable[[IntArray, IntArray], int]
) -> tuple[IntArray, IntArray, IntArray]:
    """What a search for runs leaves, and room for their parents."""
    runs, ends = np.empty((_FEW_RUNS, 2), dtype=np.int32), np.empty(height, dtype=np.int32)
    n = find(runs, ends)
    if n > len(runs):
        runs = np.empty((n, 2), dtype=np.int32)
        find(runs, ends)
    return runs, ends, np.empty(n, dtype=np.int32)
