"""The sensor of `sim_devices.sensor_kernels`, written for reading."""

import numpy as np
from numpy.typing import NDArray


def expose_reference(
    radiance: NDArray[np.float32],
    noise: NDArray[np.float32],
    row_starts: NDArray[np.int64],
    parameters: NDArray[np.float32],
    curve: NDArray[np.uint8],
) -> NDArray[np.uint8]:
    """Same arguments as `expose_rows`, result returned."""
    full_well_e, read_variance, exposure, steps_per_e = parameters.astype(np.float64)
    rows, columns = radiance.shape
    electrons = radiance.astype(np.float64) * full_well_e * exposure
    electrons = np.clip(electrons, 0.0, 4.0 * full_well_e)
    row_noise = np.stack([noise[start : start + columns] for start in row_starts])
    electrons = electrons + row_noise * np.sqrt(electrons + read_variance)
    electrons = np.clip(electrons, 0.0, full_well_e)
    steps = np.floor(electrons * steps_per_e + 0.5).astype(np.int64)
    assert steps.shape == (rows, columns)
    return curve[np.minimum(steps, curve.size - 1)]
