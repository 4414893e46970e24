"""Symmetric matrices whose numbers have very different units, brought to a common size.

A focal length in px and a turn in rad differ by many orders of magnitude in a normal matrix; solved
or inverted as it stands, it would lose that many digits.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray


def compute_unit_sizes(normal: FloatArray) -> FloatArray:
    """(n,) factors that bring the diagonal of a normal matrix (n, n) to one."""
    sizes: FloatArray = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    return sizes


def equilibrate(matrix: NDArray[np.floating[Any]], sizes: FloatArray) -> FloatArray:
    """Rows and columns of (n, n) times (n,); once more brings its inverse back to the units."""
    scaled: FloatArray = matrix * sizes[:, None] * sizes[None, :]
    return scaled
