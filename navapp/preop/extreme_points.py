"""The outermost point of a surface in a direction, and how well it is defined."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.values import Landmark

# What the surface of a bone from a CT is good for: whatever comes this near the outermost level
# could be the outermost point.
SURFACE_NOISE_MM = 0.3
# Where the surface is flatter than this, or has two summits, there is no such point.
WORST_SD_MM = 8.0


def find_extreme(
    vertices_mm: FloatArray,
    is_border: NDArray[np.bool_],
    among: NDArray[np.bool_],
    direction: FloatArray,
) -> Landmark | None:
    """The vertex in the middle of what is outermost; None when it is not defined.

    What is outermost where the surface was cut off may go on beyond the cut: it is none.

    The standard deviation follows from the flatness of the extremum: a surface of radius R that is
    good to e leaves a spot of radius sqrt(2 R e).

    Args:
        vertices_mm: (V, 3).
        is_border: (V,) where the surface was cut.
        among: (V,) those that count.
        direction: (3,) unit.
    """
    candidates = vertices_mm[among]
    if len(candidates) == 0:
        return None
    level = candidates @ direction
    is_spot = level > level.max() - SURFACE_NOISE_MM
    if is_border[among][is_spot].any():
        return None
    spot = candidates[is_spot]
    middle = spot.mean(axis=0)
    point = spot[int(np.argmin(((spot - middle) ** 2).sum(axis=1)))]
    # A single vertex is as uncertain as its neighbours are far; the surface's noise at the least.
    sd_mm = float(np.sqrt(((spot - point) ** 2).sum(axis=1).mean() + SURFACE_NOISE_MM**2))
    return Landmark(point, sd_mm, "surface") if sd_mm <= WORST_SD_MM else None
