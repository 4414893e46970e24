"""Compiled comparison of a rendered model with what was measured."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Bits of a pixel's class: nearer or further than the model by the fine map, or by the coarse one.
NEARER, FURTHER, COARSELY_NEARER, COARSELY_FURTHER = 1, 2, 4, 8

# All chosen. Not the model: nearer or further by the larger of this length and so many sigma of the
# fine map, or of this length and so many px of the coarse one.
OFF_MM, OFF_SIGMAS, OFF_COARSE_PX = 2.0, 4.0, 1.5
# A measured pixel whose difference is less agrees.
FIT_SIGMAS = 3.0


@njit(cache=True, nogil=True)
def classify_pixels(
    depth_mm: NDArray[np.float32],
    face_index: NDArray[np.int32],
    face_sigma_mm: NDArray[np.float64],
    disparity_px: NDArray[np.float32],
    sigma_px: NDArray[np.float32],
    is_matched: NDArray[np.bool_],
    coarse_px: NDArray[np.float32],
    scale_px_mm: float,
) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.float32], int, int]:
    """Compare every pixel of the model.

    Args:
        depth_mm: (h, w) of the rendered model.
        face_index: (h, w) its triangles, -1 beside it.
        face_sigma_mm: (F,) their standard deviation.
        disparity_px: (h, w) fine map.
        sigma_px: (h, w) its standard deviation.
        is_matched: (h, w) where it was measured.
        coarse_px: (h, w) coarse map, NaN where unknown; read where the fine one is silent.
        scale_px_mm: disparity times depth.

    Returns:
        (h, w) classes, 0 beside the model; (h, w) px measured minus model, and its standard
        deviation, both undefined where nothing was measured on the model; how many pixels are of
        the model, and how many of them agree.
    """
    classes = np.empty(depth_mm.shape, dtype=np.uint8)
    deviation = np.empty(depth_mm.shape, dtype=np.float32)
    sigma = np.empty(depth_mm.shape, dtype=np.float32)
    scale, one = np.float32(scale_px_mm), np.float32(1.0)
    n_visible, n_agreeing = 0, 0
    for y in range(depth_mm.shape[0]):
        for x in range(depth_mm.shape[1]):
            face = face_index[y, x]
            found = 0
            if face >= 0:
                n_visible += 1
                inverse_depth = one / depth_mm[y, x]
                expected_px = scale * inverse_depth
                px_per_mm = expected_px * inverse_depth
                off_px = np.float32(OFF_MM) * px_per_mm
                if is_matched[y, x]:
                    surface_px = np.float32(face_sigma_mm[face]) * px_per_mm
                    own_px = sigma_px[y, x]
                    total_px = np.sqrt(own_px * own_px + surface_px * surface_px)
                    difference_px = disparity_px[y, x] - expected_px
                    deviation[y, x], sigma[y, x] = difference_px, total_px
                    off_px = max(off_px, np.float32(OFF_SIGMAS) * total_px)
                    found = NEARER * (difference_px > off_px) + FURTHER * (difference_px < -off_px)
                    n_agreeing += abs(difference_px) < np.float32(FIT_SIGMAS) * total_px
                else:
                    off_px = max(off_px, np.float32(OFF_COARSE_PX))
                    difference_px = coarse_px[y, x] - expected_px
                    # Comparisons with NaN are false.
                    found = COARSELY_NEARER * (difference_px > off_px)
                    found += COARSELY_FURTHER * (difference_px < -off_px)
            classes[y, x] = found
    return classes, deviation, sigma, n_visible, n_agreeing
