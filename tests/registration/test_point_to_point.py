import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform, rotation_angle_deg, rotation_from_vector
from navapp.registration import (
    RegistrationModel,
    Scene,
    solution_at,
    solve_bimcc_literal,
    solve_icp,
)
from navapp.registration.point_to_point import prolong_step, solve_sums
from navapp.values import BoneModel, Reason
from tests.reference.bimcc_reference import bidirectional_pairs
from tests.registration.shapes import (
    TRUE,
    blob,
    disturbed,
    femur,
    femur_for_registration,
    mean_error_mm,
    scene_of,
    seen_cloud,
    with_clutter,
)

BLOB = RegistrationModel(blob(700))
SAMPLES = blob(500).mesh.vertices_mm
FRAMES = RigidTransform.identity("scene", "femur")

seeds = st.integers(0, 2**32 - 1)


def a_pose(seed: int, turn: float = 1.5, shift_mm: float = 100.0) -> RigidTransform:
    rng = np.random.default_rng(seed)
    rotation = rotation_from_vector(rng.normal(0.0, turn, 3))
    return RigidTransform.from_parts("scene", "femur", rotation, rng.normal(0, shift_mm, 3))


def kabsch(
    a: np.ndarray, b: np.ndarray, weight: np.ndarray, frames: RigidTransform
) -> RigidTransform:
    """The solved pose of pairs (N, 3) and their weights (N,)."""
    a, b = (np.column_stack([points, np.ones(len(points))]) for points in (a, b))
    return solve_sums((a * weight[:, None]).T @ b, frames)


def apart_mm(a: RigidTransform, b: RigidTransform) -> float:
    difference = a.apply(BLOB.points_mm) - b.apply(BLOB.points_mm)
    return float(np.linalg.norm(difference, axis=1).max())


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_exact_pairs_give_the_exact_pose_whatever_they_weigh(seed: int) -> None:
    pose, rng = a_pose(seed), np.random.default_rng(seed)
    model = rng.normal(0, 30, (20, 3))
    found = kabsch(pose.apply(model), model, rng.uniform(0.1, 9.0, 20), pose)
    np.testing.assert_allclose(found.matrix, pose.matrix, atol=1e-9)
    assert found.name == pose.name


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_points_of_a_plane_give_no_reflection(seed: int) -> None:
    pose, rng = a_pose(seed), np.random.default_rng(seed)
    model = rng.normal(0, 30, (20, 3)) * (1.0, 1.0, 0.0)
    found = kabsch(pose.apply(model), model, np.ones(20), pose)
    assert np.linalg.det(found.rotation) == pytest.approx(1.0)
    np.testing.assert_allclose(found.apply(model), pose.apply(model), atol=1e-9)


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_mirrored_points_give_the_best_rotation_and_no_reflection(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = rng.normal(0, 30, (40, 3))
    scene = model * (-1.0, 1.0, 1.0)
    found = kabsch(scene, model, np.ones(40), FRAMES)
    assert np.linalg.det(found.rotation) == pytest.approx(1.0)
    least = ((found.apply(model) - scene) ** 2).sum()
    for _ in range(20):
        twist = np.append(np.zeros(3), rng.normal(0.0, 0.3, 3))
        other = found.move(twist, scene.mean(axis=0))
        assert ((other.apply(model) - scene) ** 2).sum() >= least - 1e-6


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_no_small_motion_is_better_than_the_weighted_answer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene, model = rng.normal(0, 30, (2, 40, 3))
    weight = rng.uniform(0.0, 1.0, 40)
    found = kabsch(scene, model, weight, FRAMES)

    def cost(pose: RigidTransform) -> float:
        return float(weight @ ((pose.apply(model) - scene) ** 2).sum(axis=1))

    for twist in np.concatenate([1e-3 * np.eye(6), -1e-3 * np.eye(6)]):
        assert cost(found.move(twist, scene.mean(axis=0))) >= cost(found)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_swapped_sets_give_the_inverse_and_shifted_sets_the_shifted(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene, model = rng.normal(0, 30, (2, 40, 3))
    weight = rng.uniform(0.1, 1.0, 40)
    found = kabsch(scene, model, weight, FRAMES)
    swapped = kabsch(model, scene, weight, FRAMES.inverse())
    np.testing.assert_allclose(swapped.matrix, found.inverse().matrix, atol=1e-8)
    shift = rng.normal(0, 200, 3)
    shifted = kabsch(scene + shift, model, weight, FRAMES)
    np.testing.assert_allclose(shifted.rotation, found.rotation, atol=1e-9)
    np.testing.assert_allclose(shifted.translation_mm, found.translation_mm + shift, atol=1e-8)


@given(seeds, st.sampled_from([0.5, 2.0, 8.0]))
@settings(max_examples=15, deadline=None)
def test_the_objective_never_falls_while_the_kernel_keeps_its_width(
    seed: int, sigma_mm: float
) -> None:
    """J of the stacked pairs, paired anew before and after each weighted step."""
    rng = np.random.default_rng(seed)
    scene = with_clutter(SAMPLES + rng.normal(0.0, 0.4, SAMPLES.shape), 150, seed)
    tree, model_tree = cKDTree(scene), cKDTree(BLOB.points_mm)
    pose, last = a_pose(seed, 0.2, 4.0), 0.0
    for _ in range(12):
        _, forward = model_tree.query(pose.inverse().apply(scene))
        _, backward = tree.query(pose.apply(BLOB.points_mm))
        a = np.concatenate([scene, scene[backward]])
        b = np.concatenate([BLOB.points_mm[forward], BLOB.points_mm])
        distance = np.linalg.norm(a - pose.apply(b), axis=1)
        weight = np.exp(-0.5 * (distance / sigma_mm) ** 2)
        assert weight.mean() >= last - 1e-12
        last = weight.mean()
        pose = kabsch(a, b, weight, pose)


@pytest.mark.kernel
def test_the_literal_variant_is_weighted_kabsch_on_both_ways_under_a_narrowing_kernel() -> None:
    start = a_pose(4, 0.1, 2.0)
    found = solve_bimcc_literal(Scene(SAMPLES), BLOB, start).estimate
    assert found.is_converged
    pose, sigma_mm = start, np.inf
    for _ in range(found.iterations):
        point, vertex = bidirectional_pairs(SAMPLES, pose.apply(BLOB.points_mm))
        a, b = SAMPLES[point], BLOB.points_mm[vertex]
        distance = np.linalg.norm(a - pose.apply(b), axis=1)
        sigma_mm = np.clip(min(1.5 * np.median(distance), 0.9 * sigma_mm), 1.2, 12.0)
        solved = kabsch(a, b, np.exp(-0.5 * (distance / sigma_mm) ** 2), pose)
        pose = prolong_step(pose, solved, BLOB.centre_mm)
    assert apart_mm(found.camera_from_bone, pose) < 1e-3
    assert apart_mm(start, pose) > 1.0


def test_plain_icp_is_kabsch_on_the_nearest_vertices() -> None:
    start = a_pose(5, 0.1, 2.0)
    found = solve_icp(Scene(SAMPLES), BLOB, start).estimate
    pose = start
    for _ in range(found.iterations):
        _, vertex = cKDTree(BLOB.points_mm).query(pose.inverse().apply(SAMPLES))
        solved = kabsch(SAMPLES, BLOB.points_mm[vertex], np.ones(len(SAMPLES)), pose)
        pose = prolong_step(pose, solved, BLOB.centre_mm)
    # The model's own look-up may end beside the nearest vertex, never by much.
    assert apart_mm(found.camera_from_bone, pose) < 0.15
    assert apart_mm(start, pose) > 1.0


@pytest.mark.parametrize("solve", [solve_icp, solve_bimcc_literal])
def test_forward_and_inverse_runs_agree(solve) -> None:
    """Model and scene change places."""
    truth = a_pose(7)
    placed = TriangleMesh(truth.apply(BLOB.points_mm), blob(700).mesh.faces)
    start = truth.move((0.4, -0.3, 0.5, 0.02, -0.02, 0.01), truth.translation_mm)
    forward = solve(Scene(placed.vertices_mm), BLOB, start).estimate
    other = RegistrationModel(BoneModel("scene", placed))
    backward = solve(Scene(BLOB.points_mm), other, start.inverse()).estimate
    assert forward.is_converged
    assert backward.is_converged
    assert backward.camera_from_bone.name == "femur_from_scene"
    assert apart_mm(start, truth) > 0.5
    assert apart_mm(forward.camera_from_bone, backward.camera_from_bone.inverse()) < 2e-3
    assert apart_mm(forward.camera_from_bone, truth) < 2e-3


@pytest.mark.parametrize("solve", [solve_icp, solve_bimcc_literal])
def test_any_place_and_orientation_of_the_world_gives_the_same_pose(solve) -> None:
    scene = SAMPLES + np.random.default_rng(1).normal(0.0, 0.2, SAMPLES.shape)
    start, world = a_pose(8, 0.1, 2.0), a_pose(9).rename("world", "scene")
    here = solve(Scene(scene), BLOB, start).estimate
    there = solve(Scene(world.apply(scene)), BLOB, world @ start).estimate
    back = world.inverse() @ there.camera_from_bone
    # A step of 2e-3 mm counts as standing still, and a turned grid may change a partner.
    assert apart_mm(here.camera_from_bone, back) < 2e-3


@pytest.mark.parametrize("solve", [solve_icp, solve_bimcc_literal])
def test_two_runs_are_equal_to_the_last_bit(solve) -> None:
    start = a_pose(10, 0.1, 2.0)
    first, second = (solve(Scene(SAMPLES), BLOB, start).estimate.camera_from_bone for _ in range(2))
    assert np.array_equal(first.matrix, second.matrix)


def test_the_kernel_makes_the_literal_variant_bear_clutter_that_icp_does_not() -> None:
    clutter = with_clutter(SAMPLES, 400, 2)[len(SAMPLES) :] + np.array([25.0, 0.0, 0.0])
    scene = Scene(np.concatenate([BLOB.points_mm, clutter]))
    start = a_pose(11, 0.02, 0.3)
    literal = solve_bimcc_literal(scene, BLOB, start).estimate.camera_from_bone
    icp = solve_icp(scene, BLOB, start).estimate.camera_from_bone
    assert apart_mm(literal, FRAMES) < 0.3
    assert apart_mm(icp, FRAMES) > 1.0


def test_a_small_disturbance_of_a_clean_scene_is_mended_by_icp() -> None:
    bone, model = femur(), femur_for_registration()
    start = disturbed(model, 0.5, 0.3, 1)
    found = solve_icp(scene_of(seen_cloud(bone, 1500, 0.0)), model, start).estimate
    assert mean_error_mm(found.camera_from_bone, bone) < 0.02
    assert rotation_angle_deg(found.camera_from_bone, TRUE) < 0.05
    assert found.is_converged


@pytest.mark.parametrize("solve", [solve_icp, solve_bimcc_literal])
@pytest.mark.parametrize("n", [0, 1, 2, 59])
def test_too_few_points_say_so(solve, n: int) -> None:
    found = solve(Scene(SAMPLES[:n]), BLOB, a_pose(1, 0.1, 1.0)).estimate
    assert found.reasons == (Reason.TOO_FEW_POINTS,)
    assert not found.is_converged
    assert not np.isfinite(found.covariance).all()


@pytest.mark.parametrize("solve", [solve_icp, solve_bimcc_literal])
def test_the_figures_are_those_of_every_other_solver(solve) -> None:
    scene = Scene(SAMPLES + np.random.default_rng(1).normal(0.0, 0.2, SAMPLES.shape))
    found = solve(scene, BLOB, FRAMES).estimate
    same = solution_at(scene, BLOB, found.camera_from_bone).estimate
    np.testing.assert_allclose(found.covariance, same.covariance)
    assert (found.rms_mm, found.n_points) == (same.rms_mm, same.n_points)
