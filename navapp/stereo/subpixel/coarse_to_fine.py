"""Sub-pixel disparity from a coarse map: of a smooth surface, and of a whole scene.

A coarse map is stepped, and follows highlights and half-hidden rims where it should not. What is
refined on it tells a surface's true slant; a robust smooth surface through that is a better
support, on which more windows agree and the others fall out. So support and measurement take
turns, and only the last measurement is handed out. A scene with edges is refined once.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.matching.gradient import smooth_known
from navapp.stereo.subpixel.highlights import without_highlights
from navapp.stereo.subpixel.refine import RefineSettings, refine
from navapp.stereo.subpixel.regional import RegionalSettings, regional_support
from navapp.values import DisparityMap

# Steps of a coarse map are about half a pixel of it.
_SURFACE = RegionalSettings(radius_px=12)
_N_TURNS = 2
# On a support that is itself measured, a larger window rounds off crests.
_RADIUS_PX = 4
# For a support, many fair points are better than few good ones.
_FAIR = RefineSettings(
    radius_px=_RADIUS_PX, n_steps=1, min_correlation=0.5, last_step_px=0.5, max_sigma_px=0.5
)
_GOOD = RefineSettings(radius_px=_RADIUS_PX, last_step_px=0.25, max_roughness_px=0.35)
# A window that wants to be further from the surface through its neighbours follows something else.
_FAR_FROM_SURFACE_PX = 0.4
# A surface that is further from the coarse map belongs to another thing: edges keep their place.
_FAR_PX = 3.0
# Noise below this is as good as none: other errors are larger.
_SMALL_NOISE_PX = 0.05

# Of a whole scene: the Gaussian that makes its support, and how far a refined value may lie from
# the coarse one to be of the same surface.
_SUPPORT_SIGMA_PX, _CLOSE_PX = 2.0, 1.0
# A window over an edge mixes two surfaces: there the coarse value stands.
_WINDOW_PX, _SAME_SURFACE_PX = 11, 3.0


def refine_surface(pair: RectifiedPair, coarse_px: NDArray[np.float32]) -> DisparityMap:
    """Measure the surface that a coarse map shows.

    Args:
        pair: rectified grey pictures; `pair.box` is measured.
        coarse_px: (h, w) float32 disparity over the box, without steps, NaN where unknown.

    Returns:
        The map over `pair.box`: measured to a part of a pixel, or unknown.
    """
    support = coarse_px
    for _ in range(_N_TURNS):
        samples = refine(pair, support, _FAIR, _SURFACE.thin)
        surface = regional_support(samples.disparity_px, _weights(samples), support.shape, _SURFACE)
        with np.errstate(invalid="ignore"):
            is_same = np.abs(surface - coarse_px) < _FAR_PX
        support = np.where(is_same, surface, coarse_px)
    found = refine(pair, without_highlights(pair, support), _GOOD)
    with np.errstate(invalid="ignore"):
        return found.only(np.abs(found.disparity_px - support) <= _FAR_FROM_SURFACE_PX)


def _weights(samples: DisparityMap) -> NDArray[np.float32]:
    """(h, w) by the noise of each measurement."""
    noise_squared = samples.sigma_px**2 - np.float32(_FAIR.systematic_px) ** 2
    weights = np.minimum(_SMALL_NOISE_PX**2 / np.maximum(noise_squared, 1e-9), 1.0)
    found: NDArray[np.float32] = np.nan_to_num(weights).astype(np.float32)
    return found


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
