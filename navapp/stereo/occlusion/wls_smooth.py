"""Smoothing of a filled disparity map by weighted least squares.

The fast global smoother: edges of the picture separate, confident pixels lead. It makes the map
look whole; measured geometry uses the disparity before it.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import Rows, in_row_bands
from navapp.stereo.occlusion.classify import with_channels
from navapp.stereo.occlusion.wls_smooth_kernels import (
    Lines,
    Measured,
    bound_rows,
    link_rows,
    solve_columns,
    weigh_rows,
)
from navapp.values import DisparityMap

_STRENGTH = 100.0
# Of the sum of three channels: two grey levels.
_COLOUR_SIGMA = 6.0
_N_COLOUR_STEPS = 3 * 255 + 1
# Float32 keeps its digits with any value near the mean taken off.
_CENTRE_STEP = 8


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
    channels = with_channels(picture, disparity_map)
    measured = Measured(
        np.ascontiguousarray(values, dtype=np.float32),
        np.ascontiguousarray(disparity_map.sigma_px, dtype=np.float32),
        np.ascontiguousarray(disparity_map.origin),
        np.ascontiguousarray(confidence, dtype=np.float32),
    )
    centre = _centre(measured.disparity)
    columns, rows = _weigh_lines(measured, centre, channels, colour_sigma)
    height, width = values.shape
    for k in range(1, n_rounds + 1):
        step = np.float32(pass_strength(strength, k, n_rounds))
        in_row_bands(height, partial(_solve_rows, columns.values, rows, step))
        in_row_bands(width, partial(_solve_columns, columns, step))
    bounded = np.empty_like(measured.disparity)
    in_row_bands(
        height,
        lambda band: bound_rows(measured, columns.values, centre, *band, bounded),
    )
    return replace(disparity_map, disparity_px=bounded)


def pass_strength(strength: float, k: int, n_rounds: int) -> float:
    """Strength of the k-th of n rounds, k from 1: the first ones reach far, the last ones near.

    Source: Min et al. 2014, equation 11.
    """
    return 1.5 * 4.0 ** (n_rounds - k) / (4.0**n_rounds - 1.0) * strength


def _weigh_lines(
    measured: Measured, centre: np.float32, picture: NDArray[np.uint8], colour_sigma: float
) -> tuple[Lines, Lines]:
    """What is solved along the columns, and along the rows (turned; its values come later)."""
    import cv2

    height, width = measured.disparity.shape
    columns = Lines(*(np.empty((height, width), dtype=np.float32) for _ in range(3)))
    rows = Lines(*(np.empty((width, height), dtype=np.float32) for _ in range(3)))
    across = np.empty((height, width), dtype=np.float32)
    per_step = (3 // picture.shape[2]) / colour_sigma
    link_weight = np.exp(-per_step * np.arange(_N_COLOUR_STEPS)).astype(np.float32)

    def weigh(band: Rows) -> None:
        first, last = band
        weigh_rows(measured, centre, first, last, columns.values, columns.trust)
        link_rows(measured.disparity, picture, link_weight, first, last, across, columns.links)
        cv2.transpose(columns.trust[first:last], dst=rows.trust[:, first:last])
        cv2.transpose(across[first:last], dst=rows.links[:, first:last])

    in_row_bands(height, weigh)
    return columns, rows


def _solve_rows(values: NDArray[np.float32], rows: Lines, strength: np.float32, band: Rows) -> None:
    import cv2

    first, last = band
    cv2.transpose(values[first:last], dst=rows.values[:, first:last])
    solve_columns(rows, strength, first, last)
    cv2.transpose(rows.values[:, first:last], dst=values[first:last])


def _solve_columns(columns: Lines, strength: np.float32, band: Rows) -> None:
    solve_columns(columns, strength, *band)


def _centre(disparity: NDArray[np.float32]) -> np.float32:
    """About the mean of the known disparities; 0 without any."""
    part = disparity[::_CENTRE_STEP, ::_CENTRE_STEP]
    part = part[np.isfinite(part)]
    return np.float32(part.mean()) if part.size else np.float32(0.0)
