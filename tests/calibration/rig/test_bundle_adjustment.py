"""The bundle's covariance is that of its answers."""

import numpy as np
import pytest

from calibration.rig.bundle_adjustment import solve_bundle
from calibration.rig.initial_rig import vector_of
from calibration.rig.parameters import RigModel, pack
from tests.calibration.marks import BOARD, HEIGHT, WIDTH, drawn_pose, drawn_rig, seen_pair

N_DRAWS = 50


@pytest.mark.release
def test_the_covariance_is_that_of_answers_to_other_noise() -> None:
    rng = np.random.default_rng(15)
    true = drawn_rig(rng)
    model = RigModel(5, 0, WIDTH, HEIGHT)
    poses = [drawn_pose(rng, tilt_deg=40.0) for _ in range(8)]
    start = np.array([vector_of(pose.matrix) for pose in poses])
    shared = pack(model, true)
    offs, told = [], []
    for _ in range(N_DRAWS):
        pairs = [seen_pair(i, true, pose, rng) for i, pose in enumerate(poses)]
        solved = solve_bundle(BOARD, pairs, model, shared, start)
        assert solved.is_settled
        offs.append(solved.shared - shared)
        told.append(solved.covariance)
    covariance = np.mean(told, axis=0)
    # Their length in standard errors: its square is 1 a number, to 1 in (half of all numbers)^1/2.
    squared = np.einsum("ni,ij,nj->n", offs, np.linalg.inv(covariance), offs) / model.n_rig
    assert squared.mean() == pytest.approx(1.0, abs=0.15)
    scatter = np.sqrt(np.mean(np.square(offs), axis=0)) / np.sqrt(np.diag(covariance))
    assert scatter.min() > 0.7
    assert scatter.max() < 1.4
    # Each of them has the noise's own size in what it says.
    sizes = np.sqrt([np.trace(one) / np.trace(covariance) for one in told])
    assert 0.8 < sizes.min() < sizes.max() < 1.25
