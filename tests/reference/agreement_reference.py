"""Model against measurement, with whole arrays."""

import numpy as np

from navapp.tracking import agreement_kernels as limits


def classify_slowly(view, face_sigma_mm, measured_map, coarse_px, scale_px_mm):
    """Masks by name, and deviation and its standard deviation in px, NaN where not measured.

    At last how far each pixel lies from where one of the masks would change, px.
    """
    seen = view.face_index >= 0
    expected = np.where(seen, scale_px_mm / view.depth_mm.astype(float), np.nan)
    px_per_mm = expected**2 / scale_px_mm
    is_measured = seen & (measured_map.origin == 1)
    difference = np.where(is_measured, measured_map.disparity_px - expected, np.nan)
    surface_mm = face_sigma_mm[np.maximum(view.face_index, 0)]
    sigma = np.where(is_measured, np.hypot(measured_map.sigma_px, surface_mm * px_per_mm), np.nan)
    off = np.maximum(limits.OFF_SIGMAS * sigma, limits.OFF_MM * px_per_mm)
    coarse = np.where(seen & ~is_measured, coarse_px - expected, np.nan)
    off_coarse = np.maximum(limits.OFF_COARSE_PX, limits.OFF_MM * px_per_mm)
    masks = {
        "measured": is_measured,
        "nearer": difference > off,
        "further": difference < -off,
        "coarsely nearer": coarse > off_coarse,
        "coarsely further": coarse < -off_coarse,
        "agrees": np.abs(difference) < limits.FIT_SIGMAS * sigma,
    }
    apart = np.stack(
        [
            np.abs(difference) - off,
            np.abs(difference) - limits.FIT_SIGMAS * sigma,
            np.abs(coarse) - off_coarse,
        ]
    )
    clearance = np.nan_to_num(np.abs(apart), nan=np.inf).min(axis=0)
    return masks, difference, sigma, clearance
