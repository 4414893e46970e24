"""Sub-pixel disparity of a smooth surface from a coarse map: support and measurement in turns.

A coarse map is stepped, and follows highlights and half-hidden rims where it should not. What is
refined on it tells the surface's true slant; a robust smooth surface through that is a better
support, on which more windows agree and the others fall out. Only the last measurement is handed
out: a support is never a measurement.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
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
