"""Connected regions of a mask."""

import numpy as np
from numpy.typing import NDArray

from navapp.tracking.region_kernels import find_runs, join_runs, keep_large

# Most masks have few runs; one with more is gone through twice.
_FEW_RUNS = 4096


def large_regions(
    mask: NDArray[np.bool_], least_px2: int, connectivity: int = 8
) -> NDArray[np.bool_]:
    """A mask (h, w) without its connected regions of fewer pixels; 4 or 8 neighbours connect."""
    is_large = np.zeros(mask.shape, dtype=np.bool_)
    mark_large(mask.view(np.uint8), 1, least_px2, is_large, connectivity)
    return is_large


def mark_large(
    values: NDArray[np.uint8],
    bits: int,
    least_px2: int,
    is_large: NDArray[np.bool_],
    connectivity: int = 8,
) -> int:
    """Mark the large connected regions of the pixels that have one of some bits.

    Args:
        values: (h, w).
        bits: see above.
        least_px2: pixels of a large region.
        is_large: (h, w) in place; only set to True.
        connectivity: 4 or 8 neighbours connect.

    Returns:
        Pixels of large regions.
    """
    ends, room = np.empty(len(values), dtype=np.int32), _FEW_RUNS
    runs = np.empty((room, 2), dtype=np.int32)
    n = find_runs(values, bits, runs, ends)
    if n > room:
        runs = np.empty((n, 2), dtype=np.int32)
        find_runs(values, bits, runs, ends)
    parent = np.empty(n, dtype=np.int32)
    join_runs(runs, ends, 1 if connectivity == 8 else 0, parent)
    return int(keep_large(runs, ends, parent, least_px2, is_large))
