"""Where an edge lies on a line of grey values, by SciPy's least squares."""

import numpy as np
from scipy.optimize import curve_fit
from scipy.special import erf

from navapp.geometry.transform import FloatArray


def edge_profile(places_px: FloatArray, c: float, m: float, a: float, blur_px: float) -> FloatArray:
    """Grey values of an edge at c between m - a and m + a, blurred by a Gaussian."""
    return np.asarray(m + a * erf((places_px - c) / (np.sqrt(2.0) * blur_px)))


def edge_reference(greys: FloatArray, step_px: float, blur_px: float) -> tuple[float, float, float]:
    """Place, half contrast and what is left (root mean square) of the best edge of that blur."""
    half = 0.5 * (len(greys) - 1)
    places: FloatArray = step_px * np.linspace(-half, half, len(greys))
    start = (0.0, float(greys.mean()), 0.5 * float(greys[-1] - greys[0]))
    best, _ = curve_fit(
        lambda x, c, m, a: edge_profile(x, c, m, a, blur_px), places, greys, start, xtol=1e-12
    )
    c, m, a = (float(one) for one in best)
    left = np.subtract(greys, edge_profile(places, c, m, a, blur_px))
    return c, a, float(np.sqrt((left**2).mean()))
