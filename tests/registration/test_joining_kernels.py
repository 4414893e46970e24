"""The compiled join beside the same in matrices."""

import numpy as np
import pytest

from navapp.registration.joining_kernels import FurtherBlock, SurfaceBlock, solve_joined
from tests.reference import joining_reference


@pytest.mark.kernel
@pytest.mark.parametrize("k", [6, 7], ids=["pose", "pose and size"])
@pytest.mark.parametrize("noise", [0.1, 0.3, 1.5], ids=["quiet", "as claimed", "noisy"])
def test_matches_the_reference(k: int, noise: float) -> None:
    rng = np.random.default_rng([k, round(10 * noise)])
    sigmas = np.array([0.05, 0.05, 0.1, 0.002, 0.002, 0.001, 0.2])[:k]
    mixing = np.eye(k) + 0.3 * rng.normal(0.0, 1.0, (k, k))
    covariance = mixing @ np.diag(sigmas**2) @ mixing.T
    rows = rng.normal(0.0, 1.0, (90, k)) / np.sqrt(np.diag(covariance)) * 0.2
    step = rng.multivariate_normal(np.zeros(k), covariance)
    residual = rows @ step + rng.normal(0.0, noise, 90) + 0.15
    residual[:9] += 5.0
    variance, n_sharing = rng.uniform(0.05, 0.15, 90), rng.uniform(1.0, 4.0, 90)
    surface = SurfaceBlock(0.3 * step, covariance, 0.6, 1.7)
    block = FurtherBlock(rows, residual, variance, n_sharing, 0.2)
    found = solve_joined(surface, block, np.zeros(k))
    expected = joining_reference.solve_joined(surface, block, np.zeros(k))
    for one, other in zip(found, expected, strict=True):
        assert one == pytest.approx(other, rel=1e-8, abs=1e-12)
