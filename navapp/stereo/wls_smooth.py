"""Smoothing of a filled disparity map by weighted least squares.

The fast global smoother: edges of the picture separate, confident pixels lead. It makes the map
look whole; measured geometry uses the disparity before it.
"""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.stereo.bands import in_row_bands
from navapp.stereo.occlusion import as_three_channels
from navapp.stereo.wls_smooth_kernels import solve_columns, solve_rows
from navapp.values import DisparityMap, Origin

_STRENGTH = 100.0
# Of the sum of three channels: two grey levels.
_COLOUR_SIGMA = 6.0
_N_COLOUR_STEPS = 3 * 255 + 1
# Pixels that were filled, or matched without confidence, follow their neighbours.
_LEAST_TRUST = 0.02


def smooth_wls(
    disparity_map: DisparityMap,
    picture: NDArray[np.uint8],
    confidence: NDArray[np.float32],
    strength: float = _STRENGTH,
    colour_sigma: float = _COLOUR_SIGMA,
    n_rounds: int = 3,
) -> DisparityMap:
    """The map, smoothed; unknown pixels stay unknown and matched ones within their sigma.

    Minimises sum c (u - f)^2 + strength * sum exp(-|I_p - I_q| / colour_sigma) (u_p - u_q)^2 over
    four neighbours by alternating solves along rows and columns.

    Args:
        disparity_map: filled or not.
        picture: (h, w) or (h, w, 3) rectified picture over the map.
        confidence: (h, w) float32, 0 to 1; c of matched pixels.
        strength: of the smoothing.
        colour_sigma: of the sum of the three colour differences (grey counts three times).
        n_rounds: of alternating solves.

    Raises:
        ValueError: sizes that differ, or parameters out of range.

    Source: Min et al. 2014, fast global image smoothing, equations 3, 8 and 11, with the confidence
    on the diagonal.
    """
    values = disparity_map.disparity_px
    if confidence.shape != values.shape:
        raise ValueError("confidence needs the map's size")
    if strength < 0.0 or colour_sigma <= 0.0 or n_rounds < 1:
        raise ValueError("smooth_wls needs strength >= 0, colour_sigma > 0 and n_rounds >= 1")
    colours = as_three_channels(picture, disparity_map)
    is_known = np.isfinite(values)
    is_matched = is_known & (disparity_map.origin == Origin.MATCHED)
    trust = np.where(is_matched, np.nan_to_num(confidence), 0.0)
    trust = np.where(is_known, np.maximum(trust, _LEAST_TRUST), 0.0).astype(np.float32)
    link_weight = np.exp(-np.arange(_N_COLOUR_STEPS) / colour_sigma).astype(np.float32)
    # The mean is taken off so that float32 keeps its digits.
    centre = np.float32(values[is_known].mean()) if is_known.any() else np.float32(0.0)
    smooth = np.where(is_known, values - centre, np.float32(0.0)).astype(np.float32)
    height, width = values.shape
    for k in range(1, n_rounds + 1):
        step = pass_strength(strength, k, n_rounds)
        fixed = (smooth, trust, colours, link_weight, step)
        in_row_bands(height, partial(solve_rows, *fixed))
        in_row_bands(width, partial(solve_columns, *fixed))
    smooth += centre
    sigma = np.nan_to_num(disparity_map.sigma_px)
    bounded = np.clip(smooth, values - sigma, values + sigma)
    smooth = np.where(is_matched, bounded, smooth)
    return DisparityMap(
        np.where(is_known, smooth, np.float32(np.nan)).astype(np.float32),
        disparity_map.sigma_px,
        disparity_map.origin,
        disparity_map.x,
        disparity_map.y,
    )


def pass_strength(strength: float, k: int, n_rounds: int) -> float:
    """Strength of the k-th of n rounds, k from 1: the first ones reach far, the last ones near.

    Source: Min et al. 2014, equation 11.
    """
    return 1.5 * 4.0 ** (n_rounds - k) / (4.0**n_rounds - 1.0) * strength
