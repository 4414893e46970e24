"""Plates of cortex and the valleys between them, from the curvature of the density."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.preop.segmentation.masks import BoolArray

# Cortex is one to two millimetres thick: a Gaussian as wide answers to it most.
_SCALE_MM = 0.8
# Second derivatives along k, j, i.
_ORDERS = ((2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (1, 0, 1), (0, 1, 1))


@dataclass(frozen=True, slots=True, eq=False)
class Plates:
    """Curvature of the density across plates, HU per mm2; 0 outside the solids."""

    # (D, H, W) smallest second derivative: very negative in a plate of cortex.
    ridge: NDArray[np.float32]
    # (D, H, W) largest second derivative: large in a gap, and along the foot of a plate.
    valley: NDArray[np.float32]


def find_plates(hu: NDArray[np.float32], spacing_mm: FloatArray, solid: BoolArray) -> Plates:
    """Eigenvalues of the Hessian at the scale of cortex.

    Source: Sato et al. 2000, sheet structures by the Hessian's eigenvalues.
    """
    from scipy.ndimage import gaussian_filter

    steps = spacing_mm[::-1]
    hessian = np.empty((int(solid.sum()), 3, 3), dtype=np.float32)
    for orders in _ORDERS:
        scale = 1.0 / float(np.prod(steps ** np.array(orders)))
        derived = gaussian_filter(hu, _SCALE_MM / steps, order=orders, truncate=3.0)[solid] * scale
        a, b = (axis for axis in range(3) for _ in range(orders[axis]))
        hessian[:, a, b] = hessian[:, b, a] = derived
    values = np.linalg.eigvalsh(hessian)
    ridge, valley = (np.zeros(hu.shape, dtype=np.float32) for _ in range(2))
    ridge[solid], valley[solid] = values[:, 0], values[:, 2]
    return Plates(ridge, valley)
