"""One pass of the smoother along a line, from its definition as a matrix."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import diags
from scipy.sparse.linalg import spsolve


def smoothed_line(
    values: NDArray, trust: NDArray, colours: NDArray, colour_sigma: float, strength: float
) -> NDArray:
    """Minimum of sum c (u - f)^2 + strength sum g (u_i - u_i+1)^2 over the trusted pixels."""
    difference = np.abs(np.diff(colours.astype(float), axis=0)).sum(axis=1)
    link = strength * np.exp(-difference / colour_sigma) * ((trust[1:] > 0) & (trust[:-1] > 0))
    unknown = trust <= 0
    diagonal = np.where(unknown, 1.0, trust)
    diagonal[:-1] += link
    diagonal[1:] += link
    matrix = diags([-link, diagonal, -link], [-1, 0, 1], format="csc")
    return spsolve(matrix, np.where(unknown, values, trust * values))
