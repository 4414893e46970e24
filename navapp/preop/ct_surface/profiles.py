"""Density along the normals of a surface."""

from collections.abc import Callable

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.preop.volume import CtVolume

_CHUNK = 8192


def make_cubic_interpolation(ct: CtVolume) -> Callable[[FloatArray], FloatArray]:
    """Density at LPS points (..., 3), by cubic splines; the border is continued."""
    from scipy.ndimage import map_coordinates, spline_filter

    coefficients = spline_filter(ct.hu.astype(np.float32), order=3, output=np.float32)

    def at(points_mm: FloatArray) -> FloatArray:
        indices = ct.indices_of(points_mm.reshape(-1, 3))[:, ::-1].T
        found = map_coordinates(
            coefficients, indices, order=3, prefilter=False, mode="nearest", output=np.float64
        )
        values: FloatArray = found.reshape(points_mm.shape[:-1])
        return values

    return at


def sample_along(
    points_mm: FloatArray,
    normals: FloatArray,
    positions_mm: FloatArray,
    density: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """(N, n) density at positions along the normals of N points."""
    rows = [
        density(points_mm[some, None] + positions_mm[:, None] * normals[some, None])
        for some in np.array_split(np.arange(len(points_mm)), len(points_mm) // _CHUNK + 1)
    ]
    return np.concatenate(rows)
