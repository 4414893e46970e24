from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_from_vector, vector_from_rotation
from navapp.registration import RegistrationModel, Scene, fit_bimcc, solution_at
from navapp.registration.bimcc import fit_coarsely, fit_pose
from navapp.registration.bimcc_kernels import BimccSettings
from navapp.values import BoneModel, PoseEstimate, Reason
from tests.many import few_of
from tests.registration.shapes import (
    TRUE,
    as_cloud,
    ball_mesh,
    disturbed,
    facing_points,
    femur,
    femur_for_registration,
    grid_mesh,
    mean_error_mm,
    scene_of,
    seen_cloud,
    seen_scene,
    seen_vertices,
    tube_mesh,
    with_clutter,
)

BONE = femur()
MODEL = femur_for_registration()
EYE = np.zeros(3)


@pytest.mark.parametrize("seed", few_of(range(4)))
def test_a_clean_one_sided_scene_gives_the_pose_back(seed: int) -> None:
    scene = scene_of(seen_cloud(BONE, 900, 0.0, seed))
    found = fit_bimcc(scene, MODEL, disturbed(MODEL, 6.0, 5.0, seed))
    assert found.is_converged
    assert found.reasons == ()
    assert mean_error_mm(found.camera_from_bone, BONE) < 0.03
    assert found.rms_mm < 0.02


@pytest.mark.parametrize("seed", few_of(range(4)))
def test_noise_is_averaged_out(seed: int) -> None:
    scene = scene_of(seen_cloud(BONE, 1200, 0.3, seed))
    found = fit_bimcc(scene, MODEL, disturbed(MODEL, 8.0, 6.0, seed + 10))
    assert found.is_converged
    assert mean_error_mm(found.camera_from_bone, BONE) < 0.15
    assert found.inlier_fraction > 0.97
    assert 0.7 < found.rms_mm / found.expected_rms_mm < 1.25


@pytest.mark.parametrize("seed", few_of(range(3)))
def test_clutter_of_two_fifths_does_not_pull(seed: int) -> None:
    scene = seen_scene(900, 0.3, seed, n_clutter=600)
    found = fit_bimcc(scene, MODEL, disturbed(MODEL, 6.0, 5.0, seed))
    assert found.is_converged
    assert mean_error_mm(found.camera_from_bone, BONE) < 0.3


@pytest.mark.parametrize("n", [0, 1, 30, 59])
def test_too_few_points_say_so_and_are_never_called_a_fit(n: int) -> None:
    found = fit_bimcc(scene_of(seen_cloud(BONE, n, 0.1)), MODEL, disturbed(MODEL, 3.0, 2.0, 0))
    assert found.reasons == (Reason.TOO_FEW_POINTS,)
    assert not found.is_converged
    assert not np.isfinite(found.covariance).all()
    assert found.n_points == n


def test_a_scene_that_is_nowhere_near_says_so() -> None:
    cloud = seen_cloud(BONE, 800, 0.1)
    far = Scene(cloud.points_mm + np.array([400.0, 0.0, 0.0]), EYE)
    found = fit_bimcc(far, MODEL, TRUE)
    assert Reason.TOO_FEW_POINTS in found.reasons
    assert not found.is_converged


def test_points_on_the_far_side_do_not_pair() -> None:
    """A cloud of the bone's back, which no camera can see, is no measurement of it."""
    back = TRUE.apply(BONE.mesh.vertices_mm)
    normals = TRUE.rotate(BONE.mesh.normals)
    hidden = (normals * back).sum(axis=1) > 0.3 * np.linalg.norm(back, axis=1)
    points = back[hidden][::5]
    found = solution_at(Scene(points, EYE), MODEL, TRUE).estimate
    assert Reason.TOO_FEW_POINTS in found.reasons
    # Who does not say where it was seen from is taken at his word.
    assert Reason.TOO_FEW_POINTS not in solution_at(Scene(points), MODEL, TRUE).estimate.reasons


def test_parts_that_were_cut_away_pair_with_nothing() -> None:
    gone = BONE.mesh.vertices_mm[:, 0] > np.median(BONE.mesh.vertices_mm[:, 0])
    cut = RegistrationModel(replace(BONE, is_removed=gone))
    removed = seen_vertices(BONE)[gone[seen_vertices(BONE)]]
    scene = Scene(TRUE.apply(BONE.mesh.vertices_mm[removed]), EYE)
    assert len(scene) > 500
    found = solution_at(scene, cut, TRUE).estimate
    assert found.n_points < 0.05 * len(scene)


def test_points_beyond_an_open_border_pair_with_nothing() -> None:
    model = RegistrationModel(BoneModel("plate", grid_mesh(lambda x, y: 0.01 * x * x, 20.0)))
    pose = RigidTransform.from_parts("left_rect", "plate", np.eye(3), (0.0, 0.0, 400.0))
    y = np.linspace(20.5, 24.0, 100)
    beyond = np.column_stack([np.zeros(100), y, np.zeros(100)])
    found = solution_at(Scene(pose.apply(beyond)), model, pose).estimate
    assert Reason.TOO_FEW_POINTS in found.reasons


@pytest.mark.parametrize(
    ("name", "mesh"),
    [
        ("sphere", ball_mesh(30.0, 2500)),
        ("plane", grid_mesh(lambda x, y: 0.0 * x)),
        ("groove", grid_mesh(lambda x, y: 0.01 * x * x)),
        ("tube", tube_mesh(25.0, 40.0)),
    ],
)
def test_a_surface_that_leaves_a_direction_free_is_degenerate(name: str, mesh) -> None:
    bone = BoneModel(name, mesh)
    pose = RigidTransform.from_parts("left_rect", name, np.eye(3), (0.0, 0.0, 450.0))
    clean = facing_points(bone, pose)
    points = clean + np.random.default_rng(2).normal(0.0, 0.1, clean.shape)
    for scene in (Scene(points, EYE), Scene(points)):
        found = fit_bimcc(scene, RegistrationModel(bone), pose)
        assert Reason.DEGENERATE in found.reasons


def test_a_bone_is_not_degenerate() -> None:
    assert solution_at(scene_of(seen_cloud(BONE, 900, 0.2)), MODEL, TRUE).estimate.reasons == ()


def test_estimating_at_a_pose_does_not_move_it() -> None:
    pose = disturbed(MODEL, 1.0, 0.5, 3)
    found = solution_at(scene_of(seen_cloud(BONE, 900, 0.2)), MODEL, pose).estimate
    assert found.camera_from_bone is pose
    assert found.iterations == 0


@pytest.mark.parametrize(("n", "off_mm"), [(900, 0.0), (900, 6.0), (900, 400.0), (30, 0.0)])
def test_without_the_figures_the_pose_is_the_same(n: int, off_mm: float) -> None:
    cloud = seen_cloud(BONE, n, 0.2)
    scene = Scene(cloud.points_mm + np.array([off_mm, 0.0, 0.0]), EYE)
    whole, bare = fit_bimcc(scene, MODEL, TRUE), fit_pose(scene, MODEL, TRUE, BimccSettings())
    assert (bare is None) == (n == 30 or off_mm == 400.0)
    assert (bare is None) == (Reason.TOO_FEW_POINTS in whole.reasons)
    if bare is not None:
        np.testing.assert_array_equal(bare.matrix, whole.camera_from_bone.matrix)


def test_an_approach_leads_near_or_nowhere() -> None:
    scene = seen_scene(900, 0.3)
    found = fit_coarsely(scene, MODEL, disturbed(MODEL, 15.0, 8.0, 1), BimccSettings())
    assert found is not None
    assert mean_error_mm(found, BONE) < 1.0
    assert fit_coarsely(scene, MODEL, disturbed(MODEL, 0.0, 400.0, 1), BimccSettings()) is None


@pytest.mark.parametrize("seed", few_of(range(3)))
def test_any_orientation_of_the_world_gives_the_same_pose(seed: int) -> None:
    """Scene, camera and start moved together: the answer moves with them."""
    rng = np.random.default_rng(seed)
    world = RigidTransform.from_parts(
        "world", "left_rect", rotation_from_vector(rng.normal(0.0, 2.0, 3)), rng.normal(0, 300, 3)
    )
    scene, start = seen_scene(900, 0.3, seed, 300), disturbed(MODEL, 10.0, 8.0, seed)
    moved = Scene(world.apply(scene.points_mm), world.apply(EYE))
    here = fit_bimcc(scene, MODEL, start)
    there = fit_bimcc(moved, MODEL, world @ start)
    back = world.inverse() @ there.camera_from_bone
    targets = BONE.mesh.vertices_mm[::50]
    apart = np.linalg.norm(back.apply(targets) - here.camera_from_bone.apply(targets), axis=1).max()
    # The grid over the scene follows its axes: another path from far, the same place at rest.
    assert apart < 0.02
    assert there.is_converged
    turn = np.kron(np.eye(2), world.rotation)
    expected = turn @ here.covariance @ turn.T
    np.testing.assert_allclose(there.covariance, expected, atol=0.05 * np.abs(expected).max())


def test_two_runs_are_equal_to_the_last_bit() -> None:
    start = disturbed(MODEL, 15.0, 10.0, 2)
    runs = [fit_bimcc(seen_scene(900, 0.3, 1, 600), MODEL, start) for _ in range(2)]
    assert np.array_equal(runs[0].camera_from_bone.matrix, runs[1].camera_from_bone.matrix)
    assert np.array_equal(runs[0].covariance, runs[1].covariance)


def test_a_cloud_with_normals_registers_as_its_mesh_does() -> None:
    chosen = np.random.default_rng(3).choice(len(BONE.mesh.vertices_mm), 5000, replace=False)
    no_faces = np.empty((0, 3), dtype=np.int32)
    mesh = type(BONE.mesh)(BONE.mesh.vertices_mm[chosen], no_faces, BONE.mesh.normals[chosen])
    model = RegistrationModel(BoneModel("femur", mesh))
    found = fit_bimcc(seen_scene(900, 0.3, 1, 300), model, disturbed(MODEL, 10.0, 8.0, 1))
    assert found.is_converged
    assert mean_error_mm(found.camera_from_bone, BONE) < 0.2


def twist_from_truth(estimate: PoseEstimate) -> np.ndarray:
    pose = estimate.camera_from_bone
    shift = pose.apply(MODEL.centre_mm) - TRUE.apply(MODEL.centre_mm)
    return np.append(shift, vector_from_rotation(pose.rotation @ TRUE.rotation.T))


def assert_predicts_the_scatter(estimates: list[PoseEstimate]) -> None:
    twists = np.array([twist_from_truth(e) for e in estimates])
    sampled = np.sqrt((twists**2).mean(axis=0))
    predicted = np.sqrt(np.mean([np.diag(e.covariance) for e in estimates], axis=0))
    ratio = predicted / sampled
    assert (ratio > 1.0 / 1.4).all(), ratio
    assert (ratio < 1.4).all(), ratio


def test_the_covariance_predicts_the_scatter_of_known_noise() -> None:
    """Of the six twist components and of the visible vertices, over fifty noises of one cloud.

    The noise is what the estimator is told: along the rays, and of the model along its normals.
    """
    sigma_mm, rng = 0.4, np.random.default_rng(7)
    chosen = rng.choice(seen_vertices(BONE), 900, replace=False)
    clean = TRUE.apply(BONE.mesh.vertices_mm[chosen])
    rays = clean / np.linalg.norm(clean, axis=1, keepdims=True)
    normals = TRUE.rotate(BONE.mesh.normals[chosen])
    estimates = []
    for seed in range(50):
        along, out = np.random.default_rng(seed).normal(0.0, 1.0, (2, 900, 1))
        noise = sigma_mm * along * rays + MODEL.SURFACE_SIGMA_MM * out * normals
        estimates.append(fit_bimcc(scene_of(as_cloud(clean + noise, sigma_mm)), MODEL, TRUE))
    assert_predicts_the_scatter(estimates)
    targets = BONE.mesh.vertices_mm[chosen[::20]]
    covered = [
        np.linalg.norm(e.camera_from_bone.apply(targets) - TRUE.apply(targets), axis=1).mean()
        <= e.predict_tre_mm(MODEL.centre_mm, targets)
        for e in estimates
    ]
    assert np.mean(covered) >= 0.9


@pytest.mark.parametrize("n_clutter", [0, 600])
@pytest.mark.parametrize("noise_mm", [0.25, 0.6])
def test_unknown_noise_is_found_and_the_covariance_with_it(n_clutter: int, noise_mm: float) -> None:
    estimates = []
    clean = seen_cloud(BONE, 900, 0.0, 5).points_mm
    for seed in range(50):
        noise = np.random.default_rng(seed).normal(0.0, noise_mm, clean.shape)
        scene = Scene(with_clutter(clean + noise, n_clutter, seed), EYE)
        estimates.append(fit_bimcc(scene, MODEL, TRUE))
    assert all(e.is_converged for e in estimates)
    expected_mm = np.mean([e.expected_rms_mm for e in estimates])
    assert expected_mm == pytest.approx(noise_mm, rel=0.25)
    # Residuals under the kernel are a little smaller than all of them.
    assert 0.8 < np.mean([e.rms_mm for e in estimates]) / noise_mm < 1.15
    assert_predicts_the_scatter(estimates)


def test_known_noise_is_taken_at_its_word() -> None:
    cloud = seen_cloud(BONE, 900, 0.1)

    def told(sigma_mm: float) -> PoseEstimate:
        sigma = np.full(len(cloud), sigma_mm)
        return solution_at(Scene(cloud.points_mm, EYE, sigma), MODEL, TRUE).estimate

    small, large = told(2.0), told(4.0)
    ratio = np.diag(large.covariance) / np.diag(small.covariance)
    np.testing.assert_allclose(ratio, 4.0, rtol=0.05)
    assert small.rms_mm < 0.3
    assert 1.0 < small.expected_rms_mm < 2.0
    unknown = solution_at(Scene(cloud.points_mm, EYE), MODEL, TRUE).estimate
    assert unknown.expected_rms_mm < 0.2
    assert np.diag(unknown.covariance).max() < 0.1 * np.diag(small.covariance).max()


@pytest.mark.parametrize("sigma_mm", [1.0, 2.0])
def test_points_take_part_as_far_off_as_their_own_noise_lets_expect(sigma_mm: float) -> None:
    cloud = seen_cloud(BONE, 900, sigma_mm, 3)
    found = solution_at(scene_of(cloud), MODEL, TRUE).estimate
    assert found.n_points > 0.95 * len(cloud)


def test_neighbouring_points_within_the_correlation_count_as_one() -> None:
    cloud = replace(seen_cloud(BONE, 900, 0.3), stride_px=3)
    alone = solution_at(Scene.from_stereo(cloud, 1.0), MODEL, TRUE).estimate.covariance
    shared = solution_at(Scene.from_stereo(cloud, 12.0), MODEL, TRUE).estimate.covariance
    np.testing.assert_allclose(shared, 16.0 * alone, rtol=1e-9)


def test_cartilage_is_fitted_where_it_lies_and_widens_the_answer() -> None:
    n = len(BONE.mesh.vertices_mm)
    coated = RegistrationModel(
        replace(BONE, cartilage_mm=np.full(n, 2.0), cartilage_sd_mm=np.full(n, 0.5))
    )
    chosen = seen_vertices(BONE)[::8]
    points = TRUE.apply(coated.points_mm[chosen])
    scene = Scene(points, EYE, np.full(len(points), 0.1))
    found = fit_bimcc(scene, coated, disturbed(MODEL, 4.0, 3.0, 1))
    assert mean_error_mm(found.camera_from_bone, BONE) < 0.05
    sure = RegistrationModel(replace(BONE, cartilage_mm=np.full(n, 2.0)))
    certain = solution_at(scene, sure, TRUE).estimate.covariance
    assert np.trace(found.covariance) > 4.0 * np.trace(certain)
