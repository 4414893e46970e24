import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_angle_deg, rotation_from_vector
from navapp.registration import RegistrationModel, fit_icp
from navapp.registration.icp import kabsch
from navapp.registration.point_to_plane import estimate_at
from navapp.values import Reason
from tests.registration.shapes import TRUE, disturbed, femur, mean_error_mm, seen_cloud

BONE = femur()
MODEL = RegistrationModel(BONE)


def a_pose(seed: int) -> RigidTransform:
    rng = np.random.default_rng(seed)
    return RigidTransform.from_parts(
        "left_rect", "femur", rotation_from_vector(rng.normal(0, 1.5, 3)), rng.normal(0, 100, 3)
    )


@pytest.mark.parametrize("seed", range(5))
def test_exact_pairs_give_the_exact_pose(seed: int) -> None:
    pose = a_pose(seed)
    model = np.random.default_rng(seed).normal(0, 30, (20, 3))
    found = kabsch(pose.apply(model), model, pose)
    np.testing.assert_allclose(found.matrix, pose.matrix, atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_points_of_a_plane_give_no_reflection(seed: int) -> None:
    pose = a_pose(seed)
    model = np.random.default_rng(seed).normal(0, 30, (20, 3)) * (1.0, 1.0, 0.0)
    found = kabsch(pose.apply(model), model, pose)
    assert np.linalg.det(found.rotation) > 0.0
    np.testing.assert_allclose(found.apply(model), pose.apply(model), atol=1e-9)


def test_mirrored_points_give_a_rotation_all_the_same() -> None:
    model = np.random.default_rng(1).normal(0, 30, (40, 3))
    found = kabsch(model * (-1.0, 1.0, 1.0), model, TRUE)
    assert np.linalg.det(found.rotation) == pytest.approx(1.0)


def test_a_small_disturbance_of_a_clean_cloud_is_mended() -> None:
    start = disturbed(MODEL, 0.5, 0.3, 1)
    found = fit_icp(seen_cloud(BONE, 1500, 0.0), MODEL, start)
    assert mean_error_mm(found.camera_from_bone, BONE) < 0.02
    assert rotation_angle_deg(found.camera_from_bone, TRUE) < 0.05
    assert found.is_converged


@pytest.mark.parametrize("n", [0, 2, 40])
def test_too_few_points_say_so(n: int) -> None:
    start = disturbed(MODEL, 2.0, 1.0, 1)
    found = fit_icp(seen_cloud(BONE, n, 0.0), MODEL, start)
    assert Reason.TOO_FEW_POINTS in found.reasons
    assert not found.is_converged


def test_the_covariance_counts_points_as_the_other_estimator_does() -> None:
    cloud = seen_cloud(BONE, 1500, 0.1)
    found = fit_icp(cloud, MODEL, TRUE)
    same = estimate_at(cloud, MODEL, found.camera_from_bone)
    np.testing.assert_allclose(found.covariance, same.covariance)
