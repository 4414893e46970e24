"""Connected regions of a mask."""

import numpy as np
from numpy.typing import NDArray


def large_regions(
    mask: NDArray[np.bool_], least_px2: int, connectivity: int = 8
) -> NDArray[np.bool_]:
    """A mask (h, w) without its connected regions of fewer pixels; 4 or 8 neighbours connect."""
    import cv2

    # Most masks are empty, and looking for regions takes longer than counting.
    if np.count_nonzero(mask) < least_px2:
        return np.zeros_like(mask)
    _, labels, statistics, _ = cv2.connectedComponentsWithStats(
        mask.astype(np.uint8), connectivity=connectivity
    )
    is_large = statistics[:, cv2.CC_STAT_AREA] >= least_px2
    is_large[0] = False
    large: NDArray[np.bool_] = is_large[labels]
    return large
