"""Nearest vertex by trying all."""

import numpy as np
from numpy.typing import NDArray


def nearest_by_trying_all(
    points_mm: NDArray[np.float64], vertices_mm: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Index of, and distance to, the nearest vertex of each point."""
    offset = points_mm[:, None, :] - vertices_mm[None, :, :]
    distance = np.sqrt((offset**2).sum(axis=2))
    return distance.argmin(axis=1), distance.min(axis=1)
