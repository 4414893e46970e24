"""Compiled comparison of a rendered model with what was measured."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# What a pixel of the model is, one bit each: measured; nearer or further than the model by the fine
# map, and by the coarse one; measured and agreeing.
MEASURED, NEARER, FURTHER, COARSELY_NEARER, COARSELY_FURTHER, AGREES = 1, 2, 4, 8, 16, 32


class Comparison(NamedTuple):
    """Limits and scale of a comparison.

    Attributes:
        scale_px_mm: focal length times baseline: disparity times depth.
        off_mm, off_sigmas: nearer or further by the larger of both is not the model.
        off_coarse_px: the same for the coarse map, beside `off_mm`.
        fit_sigmas: a difference of less agrees.
    """

    scale_px_mm: float
    off_mm: float
    off_sigmas: float
    off_coarse_px: float
    fit_sigmas: float


@njit(cache=True, nogil=True)
def classify_pixels(
    depth_mm: NDArray[np.float32],
    face_index: NDArray[np.int32],
    face_sigma_mm: NDArray[np.float64],
    disparity_px: NDArray[np.float32],
    sigma_px: NDArray[np.float32],
    is_matched: NDArray[np.bool_],
    coarse_px: NDArray[np.float32],
    limits: Comparison,
    classes: NDArray[np.uint8],
    deviation: NDArray[np.float32],
    sigma: NDArray[np.float32],
) -> tuple[int, int]:
    """What every pixel of the model is.

    Args:
        depth_mm: (h, w) of the rendered model.
        face_index: (h, w) its triangles, -1 beside it.
        face_sigma_mm: (F,) their standard deviation.
        disparity_px: (h, w) fine map.
        sigma_px: (h, w) its standard deviation.
        is_matched: (h, w) where it was measured.
        coarse_px: (h, w) coarse map, NaN where unknown; read where the fine one is silent.
        limits: and scale.
        classes: (h, w) in place, bits; 0 beside the model.
        deviation: (h, w) in place, px: measured minus model, where measured.
        sigma: (h, w) in place, px, its standard deviation.

    Returns:
        Pixels of the model, and those that agree.
    """
    scale, off_mm = np.float32(limits.scale_px_mm), np.float32(limits.off_mm)
    off_sigmas, fit_sigmas = np.float32(limits.off_sigmas), np.float32(limits.fit_sigmas)
    off_coarse_px, one = np.float32(limits.off_coarse_px), np.float32(1.0)
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
                off_px = off_mm * px_per_mm
                if is_matched[y, x]:
                    surface_px = np.float32(face_sigma_mm[face]) * px_per_mm
                    own_px = sigma_px[y, x]
                    total_px = np.sqrt(own_px * own_px + surface_px * surface_px)
                    difference_px = disparity_px[y, x] - expected_px
                    deviation[y, x], sigma[y, x] = difference_px, total_px
                    off_px = max(off_px, off_sigmas * total_px)
                    found = MEASURED + NEARER * (difference_px > off_px)
                    found += FURTHER * (difference_px < -off_px)
                    agrees = abs(difference_px) < fit_sigmas * total_px
                    found += AGREES * agrees
                    n_agreeing += agrees
                else:
                    off_px = max(off_px, off_coarse_px)
                    # Comparisons with NaN are false.
                    found = COARSELY_NEARER * (coarse_px[y, x] - expected_px > off_px)
                    found += COARSELY_FURTHER * (coarse_px[y, x] - expected_px < -off_px)
            classes[y, x] = found
    return n_visible, n_agreeing


@njit(cache=True, nogil=True)
def gather_open(
    classes: NDArray[np.uint8],
    is_hidden: NDArray[np.bool_],
    deviation: NDArray[np.float32],
    sigma: NDArray[np.float32],
    every: int,
    deviations: NDArray[np.float32],
    sigmas: NDArray[np.float32],
) -> tuple[int, int]:
    """Deviations of measured pixels that nothing hides: how many there are, and were gathered.

    Args:
        classes: (h, w) as `classify_pixels` leaves it.
        is_hidden: (h, w) pixels that something hides.
        deviation: (h, w) px.
        sigma: (h, w) px.
        every: only rows and columns that are multiples of this are gathered.
        deviations: in place, px; room for all that are gathered.
        sigmas: the same.
    """
    n_open, n = 0, 0
    for y in range(classes.shape[0]):
        for x in range(classes.shape[1]):
            n_open += (classes[y, x] & MEASURED != 0) * (not is_hidden[y, x])
    for y in range(0, classes.shape[0], every):
        for x in range(0, classes.shape[1], every):
            if classes[y, x] & MEASURED and not is_hidden[y, x]:
                deviations[n], sigmas[n] = deviation[y, x], sigma[y, x]
                n += 1
    return n_open, n
