"""Sub-pixel disparity of a whole scene, whose matches are all kept."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.matching.gradient import smooth_known
from navapp.stereo.subpixel.refine import refine
from navapp.values import DisparityMap

_SUPPORT_SIGMA_PX = 2.0
# Further away than this, a refined value is not the same surface's any more.
_CLOSE_PX = 1.0
# A window over an edge mixes two surfaces: there the coarse value stands.
_WINDOW_PX = 11
_SAME_SURFACE_PX = 3.0


def refine_scene(pair: RectifiedPair, coarse: DisparityMap) -> DisparityMap:
    """Sub-pixel values where they settle close to the coarse ones, the coarse ones elsewhere.

    Args:
        pair: it was matched in.
        coarse: of every match.
    """
    # Smoothed only to make a support: a map that was smoothed itself would be tilted.
    finer = refine(pair, smooth_known(coarse.disparity_px, _SUPPORT_SIGMA_PX))
    with np.errstate(invalid="ignore"):
        is_finer = np.abs(finer.disparity_px - coarse.disparity_px) < _CLOSE_PX
    is_finer &= _local_range_px(coarse.disparity_px) < _SAME_SURFACE_PX
    return replace(
        coarse,
        disparity_px=np.where(is_finer, finer.disparity_px, coarse.disparity_px),
        sigma_px=np.where(is_finer, finer.sigma_px, coarse.sigma_px),
    )


def _local_range_px(disparity_px: NDArray[np.float32]) -> NDArray[np.float32]:
    """Largest minus smallest known disparity in each pixel's window."""
    import cv2

    window = np.ones((_WINDOW_PX, _WINDOW_PX), dtype=np.uint8)
    known = np.isfinite(disparity_px)
    largest = cv2.dilate(np.where(known, disparity_px, np.float32(-1e6)), window)
    smallest = cv2.erode(np.where(known, disparity_px, np.float32(1e6)), window)
    return np.asarray(largest - smallest, dtype=np.float32)
