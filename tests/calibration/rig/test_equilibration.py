"""Matrices of very different units, brought to a common size."""

import numpy as np

from calibration.rig.equilibration import compute_unit_sizes, equilibrate


def test_the_diagonal_becomes_one_and_the_inverse_comes_back_to_the_units() -> None:
    units = np.array([1e-6, 1.0, 1e5])
    mixed = np.array([[2.0, 0.3, 0.1], [0.3, 1.0, 0.2], [0.1, 0.2, 3.0]])
    normal = mixed * np.outer(units, units)
    sizes = compute_unit_sizes(normal)
    scaled = equilibrate(normal, sizes)
    np.testing.assert_allclose(np.diag(scaled), 1.0, rtol=1e-12)
    inverse = equilibrate(np.linalg.inv(scaled), sizes)
    np.testing.assert_allclose(inverse * np.outer(units, units), np.linalg.inv(mixed), rtol=1e-10)
