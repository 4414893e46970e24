from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, vector_from_rotation
from navapp.registration import PointToPlaneSettings, RegistrationModel, fit_point_to_plane
from navapp.registration.point_to_plane import estimate_at
from navapp.values import BoneModel, Reason, predicted_tre_mm
from tests.registration.shapes import (
    TRUE,
    as_cloud,
    disturbed,
    femur,
    grid_mesh,
    mean_error_mm,
    seen_cloud,
    seen_vertices,
)

BONE = femur()
MODEL = RegistrationModel(BONE)
# Points of these clouds have independent errors.
INDEPENDENT = PointToPlaneSettings(correlation_px=1.0)


@pytest.mark.parametrize("seed", range(4))
def test_a_clean_one_sided_cloud_gives_the_pose_back(seed: int) -> None:
    start = disturbed(MODEL, 6.0, 5.0, seed)
    found = fit_point_to_plane(seen_cloud(BONE, 900, 0.0, seed), MODEL, start)
    assert found.is_converged
    assert found.reasons == ()
    assert mean_error_mm(found.camera_from_bone, BONE) < 0.03
    assert found.rms_mm < 0.02


@pytest.mark.parametrize("seed", range(4))
def test_noise_is_averaged_out(seed: int) -> None:
    start = disturbed(MODEL, 8.0, 6.0, seed + 10)
    found = fit_point_to_plane(seen_cloud(BONE, 1200, 0.3, seed), MODEL, start)
    assert found.is_converged
    assert mean_error_mm(found.camera_from_bone, BONE) < 0.15
    assert found.inlier_share > 0.97
    assert 0.7 < found.rms_mm / found.expected_rms_mm < 1.25


@pytest.mark.parametrize("seed", range(3))
def test_clutter_of_two_fifths_does_not_pull(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bone_points = seen_cloud(BONE, 900, 0.3, seed)
    centre = bone_points.points_mm.mean(axis=0)
    clutter = centre + rng.uniform(-1.0, 1.0, (600, 3)) * (45.0, 45.0, 35.0)
    cloud = as_cloud(np.concatenate([bone_points.points_mm, clutter]), 0.3)
    found = fit_point_to_plane(cloud, MODEL, disturbed(MODEL, 6.0, 5.0, seed))
    assert mean_error_mm(found.camera_from_bone, BONE) < 0.4


@pytest.mark.parametrize("n", [0, 1, 30, 59])
def test_too_few_points_say_so_and_are_never_called_a_fit(n: int) -> None:
    start = disturbed(MODEL, 3.0, 2.0, 0)
    found = fit_point_to_plane(seen_cloud(BONE, n, 0.1), MODEL, start)
    assert Reason.TOO_FEW_POINTS in found.reasons
    assert not found.is_converged
    assert not np.isfinite(found.covariance).all()


def test_a_cloud_that_is_nowhere_near_says_so() -> None:
    cloud = seen_cloud(BONE, 800, 0.1)
    far = replace(cloud, points_mm=cloud.points_mm + np.array([400.0, 0.0, 0.0]))
    found = fit_point_to_plane(far, MODEL, TRUE)
    assert Reason.TOO_FEW_POINTS in found.reasons
    assert not found.is_converged


@pytest.mark.parametrize(
    ("name", "height_of"),
    [
        ("sphere", lambda x, y: 100.0 - np.sqrt(100.0**2 - x * x - y * y)),
        ("plane", lambda x, y: 0.0 * x),
        ("groove", lambda x, y: 0.01 * x * x),
    ],
)
def test_a_surface_that_leaves_a_direction_free_is_degenerate(name: str, height_of) -> None:
    bone = BoneModel(name, grid_mesh(height_of))
    pose = RigidTransform.from_parts("left_rect", name, np.eye(3), (0.0, 0.0, 450.0))
    rng = np.random.default_rng(2)
    inner = np.abs(bone.mesh.vertices_mm[:, :2]).max(axis=1) < 25.0
    points = pose.apply(bone.mesh.vertices_mm[inner]) + rng.normal(0, 0.1, (inner.sum(), 3))
    found = fit_point_to_plane(as_cloud(points, 0.1), RegistrationModel(bone), pose)
    assert Reason.DEGENERATE in found.reasons


def test_a_bone_is_not_degenerate() -> None:
    assert estimate_at(seen_cloud(BONE, 900, 0.2), MODEL, TRUE).reasons == ()


def test_estimating_at_a_pose_does_not_move_it() -> None:
    pose = disturbed(MODEL, 1.0, 0.5, 3)
    found = estimate_at(seen_cloud(BONE, 900, 0.2), MODEL, pose)
    assert found.camera_from_bone is pose
    assert found.iterations == 0


def test_points_on_the_far_side_do_not_pair() -> None:
    """A cloud of the bone's back, which no camera can see, is no measurement of it."""
    back = TRUE.apply(BONE.mesh.vertices_mm)
    normals = TRUE.rotate(BONE.mesh.normals)
    hidden = np.einsum("ij,ij->i", normals, back) > 0.3 * np.linalg.norm(back, axis=1)
    found = estimate_at(as_cloud(back[hidden][::5], 0.1), MODEL, TRUE)
    assert Reason.TOO_FEW_POINTS in found.reasons


def test_the_covariance_predicts_the_scatter() -> None:
    """Of the six twist components and of the visible vertices, over fifty noises of one cloud.

    The noise is what the estimator is told: along the rays, and of the model along its normals.
    """
    sigma_mm, rng = 0.4, np.random.default_rng(7)
    chosen = rng.choice(seen_vertices(BONE), 900, replace=False)
    clean = TRUE.apply(BONE.mesh.vertices_mm[chosen])
    rays = clean / np.linalg.norm(clean, axis=1, keepdims=True)
    normals = TRUE.rotate(BONE.mesh.normals[chosen])
    twists, estimates = [], []
    centre = TRUE.apply(MODEL.centre_mm)
    for seed in range(50):
        along, out = np.random.default_rng(seed).normal(0.0, 1.0, (2, 900, 1))
        noise = sigma_mm * along * rays + MODEL.SURFACE_SIGMA_MM * out * normals
        cloud = as_cloud(clean + noise, sigma_mm)
        found = fit_point_to_plane(cloud, MODEL, TRUE, INDEPENDENT)
        pose = found.camera_from_bone
        shift = pose.apply(MODEL.centre_mm) - centre
        twists.append(np.append(shift, vector_from_rotation(pose.rotation @ TRUE.rotation.T)))
        estimates.append(found)
    sampled = np.sqrt((np.array(twists) ** 2).mean(axis=0))
    predicted = np.sqrt(np.mean([np.diag(e.covariance) for e in estimates], axis=0))
    ratio = predicted / sampled
    assert (ratio > 1.0 / 1.4).all(), ratio
    assert (ratio < 1.4).all(), ratio
    targets = BONE.mesh.vertices_mm[chosen[::20]]
    covered = [
        np.linalg.norm(e.camera_from_bone.apply(targets) - TRUE.apply(targets), axis=1).mean()
        <= predicted_tre_mm(e, MODEL.centre_mm, targets)
        for e in estimates
    ]
    assert np.mean(covered) >= 0.9


def test_neighbouring_points_within_the_correlation_count_as_one() -> None:
    cloud = seen_cloud(BONE, 900, 0.3)
    alone = estimate_at(cloud, MODEL, TRUE, settings=INDEPENDENT).covariance
    settings = PointToPlaneSettings(correlation_px=12.0)
    cloud = replace(cloud, stride_px=3)
    shared = estimate_at(cloud, MODEL, TRUE, settings=settings).covariance
    np.testing.assert_allclose(shared, 16.0 * alone, rtol=1e-9)
