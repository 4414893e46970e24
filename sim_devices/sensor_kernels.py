"""The noise of an image sensor, pixel by pixel."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def expose_rows(
    radiance: NDArray[np.float32],
    noise: NDArray[np.float32],
    row_starts: NDArray[np.int64],
    parameters: NDArray[np.float32],
    curve: NDArray[np.uint8],
    scratch: NDArray[np.int32],
    picture: NDArray[np.uint8],
) -> None:
    """Shot noise, read noise, clipping and tone curve.

    Args:
        radiance: (rows, n) float32, 1.0 = full well at nominal exposure.
        noise: (m,) standard normal values, m >= max(row_starts) + n.
        row_starts: (rows,) int64, where in `noise` each row begins to read.
        parameters: (4,) float32: full well in e, read noise in e squared, exposure, table steps
            for one electron.
        curve: (k,) uint8 grey values over 0..1, gain applied before.
        scratch: (n,) int32.
        picture: (rows, n) uint8, written.
    """
    full_well_e, read_variance, exposure, steps_per_e = parameters
    electrons_per_unit = full_well_e * exposure
    overflow_e = np.float32(4.0) * full_well_e
    half = np.float32(0.5)
    zero = np.float32(0.0)
    top = np.float32(curve.size - 1)
    n_rows, n_columns = radiance.shape
    for row in range(n_rows):
        start = row_starts[row]
        for column in range(n_columns):
            electrons = radiance[row, column] * electrons_per_unit
            # NaN and infinity must not become an index, so neither test may let them through.
            if not electrons > zero:
                electrons = zero
            if not electrons < overflow_e:
                electrons = overflow_e
            electrons += noise[start + column] * np.sqrt(electrons + read_variance)
            step = min(electrons, full_well_e) * steps_per_e + half
            scratch[column] = np.int32(min(max(step, zero), top))
        for column in range(n_columns):
            picture[row, column] = curve[scratch[column]]
