from dataclasses import replace
from functools import cache
from importlib import import_module

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.registration import Outcome, RegistrationModel, Scene, point_to_point, register
from navapp.registration.bimcc import solution_at
from navapp.registration.multi_start import ScoredPose
from navapp.registration.register import measure_smooth_part_mm
from navapp.values import BoneModel, Reason
from tests.many import few_of, few_rows_of
from tests.registration.shapes import (
    TRUE,
    ball_mesh,
    blob,
    disturbed,
    facing_points,
    femur,
    femur_for_registration,
    grid_mesh,
    mean_error_mm,
    seen_scene,
    tube_mesh,
)

BONE = femur()
MODEL = femur_for_registration()
EYE = np.zeros(3)
METHODS = ("bimcc", "icp", "bimcc-literal")


@pytest.mark.parametrize("seed", few_of(range(5)))
def test_the_pose_is_found_from_far_through_clutter(seed: int) -> None:
    scene = seen_scene(1200, 0.4, seed, n_clutter=800)
    found = register(scene, MODEL, disturbed(MODEL, 25.0, 15.0, seed))
    assert found.outcome is Outcome.CONVERGED
    assert found.reasons == ()
    assert mean_error_mm(found.estimate.camera_from_bone, BONE) < 0.25
    assert found.coverage is not None
    assert 0.85 < found.coverage <= 1.0
    assert found.n_starts in (1, 14, 245)


def test_a_good_start_is_the_only_one() -> None:
    found = register(seen_scene(900, 0.3), MODEL, disturbed(MODEL, 4.0, 3.0, 1))
    assert found.n_starts == 1
    everywhere = register(
        seen_scene(900, 0.3), MODEL, disturbed(MODEL, 4.0, 3.0, 1), is_global=True
    )
    assert everywhere.n_starts == 14
    assert mean_error_mm(everywhere.estimate.camera_from_bone, BONE) < 0.2


@pytest.mark.release
@pytest.mark.parametrize("seed", range(3))
def test_the_search_everywhere_finds_a_bone_that_is_turned_away(seed: int) -> None:
    start = disturbed(MODEL, 120.0, 0.0, seed)
    found = register(seen_scene(1200, 0.4, seed), MODEL, start, is_global=True)
    assert found.outcome is Outcome.CONVERGED
    assert mean_error_mm(found.estimate.camera_from_bone, BONE) < 0.25
    # Near the start, further off, then about the scene's middle in five rings.
    assert found.n_starts == 1 + 13 + 231 + 71


def only_candidates(monkeypatch: pytest.MonkeyPatch, *candidates: ScoredPose) -> None:
    """Let every search lead to these, best first."""
    # The package's own `register` is the function.
    module = import_module("navapp.registration.register")
    monkeypatch.setattr(module, "find_poses", lambda *args, **more: list(candidates))


def elsewhere(seed: int) -> RigidTransform:
    return disturbed(MODEL, 150.0, 10.0, seed)


@pytest.mark.parametrize(("score", "is_found"), [(0.55, True), (0.45, False)])
def test_candidates_that_explain_nearly_as_much_get_their_chance(
    score: float, is_found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The coarse approach may rank the right one third; what explains little costs no time."""
    wrong = ScoredPose(elsewhere(1), 1.0), ScoredPose(elsewhere(2), 0.9)
    only_candidates(monkeypatch, *wrong, ScoredPose(TRUE, score))
    found = register(seen_scene(900, 0.3), MODEL, elsewhere(3))
    assert (found.outcome is Outcome.CONVERGED) == is_found
    assert (mean_error_mm(found.estimate.camera_from_bone, BONE) < 0.25) == is_found


def test_a_search_that_leads_elsewhere_takes_nothing_away(monkeypatch: pytest.MonkeyPatch) -> None:
    only_candidates(monkeypatch, ScoredPose(elsewhere(1), 1.0))
    found = register(seen_scene(900, 0.3), MODEL, disturbed(MODEL, 4.0, 3.0, 1), is_global=True)
    assert found.outcome is Outcome.CONVERGED
    assert mean_error_mm(found.estimate.camera_from_bone, BONE) < 0.2


def test_the_search_everywhere_brings_a_distant_model_to_the_scene() -> None:
    start = TRUE.move((500.0, -300.0, 200.0, 0.0, 0.0, 0.1), TRUE.translation_mm)
    scene = seen_scene(900, 0.3)
    assert register(scene, MODEL, start).outcome is Outcome.FAILED
    found = register(scene, MODEL, start, is_global=True)
    assert found.outcome is Outcome.CONVERGED
    assert mean_error_mm(found.estimate.camera_from_bone, BONE) < 0.25


@pytest.mark.release
def test_what_is_seen_in_part_is_tried_from_other_starts_too() -> None:
    """An answer that fits is doubtful while little of the model, or nobody knows what, was seen."""
    points, start = seen_scene(900, 0.3).points_mm, disturbed(MODEL, 4.0, 3.0, 1)
    half = points[points[:, 0] < np.median(points[:, 0])]
    for scene in (Scene(half, EYE), Scene(points)):
        found = register(scene, MODEL, start)
        assert found.outcome is Outcome.CONVERGED
        assert found.n_starts == 14 + 231
        assert mean_error_mm(found.estimate.camera_from_bone, BONE) < 0.35


def test_without_a_camera_nothing_is_said_about_coverage() -> None:
    scene = seen_scene(900, 0.3, 2)
    found = register(Scene(scene.points_mm), MODEL, disturbed(MODEL, 5.0, 4.0, 1))
    assert found.coverage is None
    assert found.outcome is Outcome.CONVERGED
    assert mean_error_mm(found.estimate.camera_from_bone, BONE) < 0.25


@pytest.mark.parametrize("method", ["icp", "bimcc-literal"])
def test_the_papers_methods_are_judged_in_the_same_way(method) -> None:
    pose = RigidTransform.from_parts("left_rect", "femur", np.eye(3), (0.0, 0.0, 400.0))
    model = RegistrationModel(blob())
    points = facing_points(blob(3000), pose)
    scene = Scene(points, EYE)
    found = register(scene, model, pose.move((0.5, 0.3, 0.2, 0, 0.01, 0), (0, 0, 400)), method)
    assert found.outcome is Outcome.CONVERGED
    assert found.n_starts == 1
    assert found.coverage is not None
    assert found.coverage > 0.85
    # Far off they fail, and say so: nobody helps them with other starts.
    lost = register(scene, model, pose.move((0, 0, 0, 0, 0, 2.5), (0, 0, 400)), method)
    assert lost.outcome is Outcome.FAILED
    assert lost.reasons


def wrong_shapes() -> dict[str, TriangleMesh]:
    mesh = blob().mesh
    shapes = {"ball": ball_mesh(30.0, 1500), "tube": tube_mesh(28.0, 40.0)}
    for scale in (0.001, 0.7, 1.3, 1000.0):
        shapes[f"scaled by {scale}"] = TriangleMesh(scale * mesh.vertices_mm, mesh.faces)
    return shapes


@cache
def blob_scenes() -> tuple[RigidTransform, tuple[Scene, Scene]]:
    """Pose and scenes, with and without a camera, to which the right shape is registered."""
    pose = RigidTransform.from_parts("left_rect", "femur", TRUE.rotation, (0.0, 0.0, 470.0))
    clean = facing_points(blob(3000), pose)
    points = clean + np.random.default_rng(1).normal(0.0, 0.3, clean.shape)
    scenes, right = (Scene(points, EYE), Scene(points)), RegistrationModel(blob())
    for scene in scenes:
        assert register(scene, right, pose).outcome is Outcome.CONVERGED
    return pose, scenes


@pytest.mark.release
@pytest.mark.parametrize("name", wrong_shapes())
def test_a_scene_of_another_shape_is_never_a_registration(name: str) -> None:
    pose, scenes = blob_scenes()
    wrong = RegistrationModel(BoneModel("femur", wrong_shapes()[name]))
    for scene in scenes:
        found = register(scene, wrong, pose)
        assert found.outcome is Outcome.FAILED
        assert found.reasons


@cache
def distorted(factors: tuple[float, float, float]) -> RegistrationModel:
    """The femur, stretched about its middle."""
    mesh = BONE.mesh
    vertices = mesh.centroid_mm + np.array(factors) * (mesh.vertices_mm - mesh.centroid_mm)
    faces = mesh.faces if np.prod(factors) > 0.0 else np.ascontiguousarray(mesh.faces[:, ::-1])
    return RegistrationModel(BoneModel("femur", TriangleMesh(vertices, faces)))


@pytest.mark.parametrize("knows_noise", few_of([True, False]))
@pytest.mark.parametrize("factors", few_of([(-1.0, 1.0, 1.0), (1.1, 1.1, 1.1), (0.9, 0.9, 0.9)], 2))
def test_a_distorted_bone_is_never_a_registration(
    factors: tuple[float, float, float], knows_noise: bool
) -> None:
    scene = seen_scene(900, 0.3)
    sigma = np.full(len(scene), 0.3) if knows_noise else None
    found = register(replace(scene, sigma_ray_mm=sigma), distorted(factors), TRUE)
    assert found.outcome is Outcome.FAILED
    assert found.reasons


@pytest.mark.parametrize("factors", few_of([(1.03, 1.03, 1.03), (1.0, 1.05, 1.0)]))
def test_a_slightly_larger_bone_betrays_itself_by_what_residuals_share(
    factors: tuple[float, float, float],
) -> None:
    """It lies under the kernel everywhere, and no camera tells what should be seen."""
    found = register(Scene(seen_scene(900, 0.3).points_mm), distorted(factors), TRUE)
    assert found.outcome is Outcome.FAILED
    assert found.reasons == (Reason.SURFACE_MISFIT,)
    assert found.estimate.rms_mm < 0.6


@pytest.mark.parametrize("wave_mm", [0.0, 0.5, 1.0])
def test_the_smooth_part_is_the_rms_of_a_wave_beneath_the_noise(wave_mm: float) -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform(-30.0, 30.0, (4000, 3)) * (1.0, 1.0, 0.0)
    wave = wave_mm * np.sin(2.0 * np.pi * points[:, 0] / 30.0)
    solution = solution_at(seen_scene(900, 0.3), MODEL, TRUE)
    residual = wave + rng.normal(0.0, 0.3, 4000)
    found = measure_smooth_part_mm(replace(solution, points_mm=points, residual_mm=residual), 3.0)
    assert found == pytest.approx(wave_mm / np.sqrt(2.0), abs=0.07)
    none = replace(solution, points_mm=points[:0], residual_mm=residual[:0])
    assert measure_smooth_part_mm(none, 3.0) == 0.0


def test_a_fit_that_runs_out_of_steps_is_no_registration(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, start = seen_scene(900, 0.3), disturbed(MODEL, 1.0, 0.5, 1)
    monkeypatch.setattr(point_to_point, "_MAX_ITERATIONS", 1)
    found = register(scene, MODEL, start, "icp")
    assert found.outcome is Outcome.FAILED
    assert found.reasons == (Reason.NOT_CONVERGED,)


@pytest.mark.release
def test_a_shape_that_fits_in_two_poses_is_a_guess() -> None:
    """Half a turn maps an ellipsoid onto itself; a quarter of one leads to either."""
    axes = (22.0, 30.0, 45.0)
    egg = TriangleMesh(ball_mesh(1.0, 3000).vertices_mm * axes, ball_mesh(1.0, 3000).faces)
    noise = np.random.default_rng(1).normal(0.0, 0.2, (1100, 3))
    scene = Scene(ball_mesh(1.0, 1100).vertices_mm * axes + noise)
    quarter = RigidTransform.from_parts(
        "scene", "egg", rotation_from_vector((np.pi / 2.0, 0.0, 0.0)), (0.0, 0.0, 0.0)
    )
    found = register(scene, RegistrationModel(BoneModel("egg", egg)), quarter, is_global=True)
    assert found.outcome is Outcome.FAILED
    assert Reason.AMBIGUOUS in found.reasons


@pytest.mark.parametrize("seed", few_of(range(4)))
def test_a_shape_that_repeats_itself_every_45_degrees_is_a_guess(seed: int) -> None:
    """The twins lie beyond the near starts, and nobody knows where the camera stood."""
    ball = ball_mesh(1.0, 3000)
    x, y, z = ball.vertices_mm.T
    petals = 0.15 * np.cos(8.0 * np.arctan2(y, x)) * np.hypot(x, y) ** 8
    radius_mm = 25.0 * (1.0 + petals) * (1.0 + 0.15 * z)
    flower = TriangleMesh(radius_mm[:, None] * ball.vertices_mm, ball.faces)
    rng = np.random.default_rng(seed)
    turn = rotation_from_vector(rng.normal(size=3))
    true = RigidTransform.from_parts("scene", "flower", turn, (10.0, -20.0, 300.0))
    some_mm = flower.vertices_mm[rng.choice(len(x), 900, replace=False)]
    scene = Scene(true.apply(some_mm) + rng.normal(0.0, 0.2, some_mm.shape))
    start = true.move((1.0, 1.0, 0.0, 0.02, 0.0, 0.0), true.translation_mm)
    found = register(scene, RegistrationModel(BoneModel("flower", flower)), start)
    assert found.outcome is Outcome.FAILED
    assert Reason.AMBIGUOUS in found.reasons


@pytest.mark.release
@pytest.mark.parametrize("method", METHODS)
def test_points_all_over_the_room_are_never_a_registration(method) -> None:
    rng = np.random.default_rng(1)
    model = RegistrationModel(blob())
    pose = RigidTransform.from_parts("left_rect", "femur", np.eye(3), (0.0, 0.0, 400.0))
    points = rng.uniform(-45.0, 45.0, (800, 3)) + np.array([0.0, 0.0, 400.0])
    for scene in (Scene(points, EYE), Scene(points)):
        assert register(scene, model, pose, method).outcome is Outcome.FAILED


def surface_scene(bone: BoneModel, *, has_camera: bool) -> tuple[Scene, RigidTransform]:
    turn = rotation_from_vector((0.3, 0.1, -0.2))
    pose = RigidTransform.from_parts("left_rect", bone.name, turn, (5.0, 3.0, 450.0))
    clean = facing_points(bone, pose)
    points = clean + np.random.default_rng(2).normal(0.0, 0.1, clean.shape)
    return Scene(points, EYE if has_camera else None), pose


@pytest.mark.parametrize("has_camera", few_of([True, False]))
@pytest.mark.parametrize(
    ("name", "mesh", "n_turns", "n_shifts"),
    few_rows_of(
        [
            ("sphere", ball_mesh(30.0, 2500), 3, 0),
            ("plane", grid_mesh(lambda x, y: 0.0 * x), 1, 2),
            ("cylinder", tube_mesh(25.0, 40.0), 1, 1),
        ],
        2,
    ),
)
def test_what_a_simple_surface_leaves_free_is_said_in_words(
    name: str, mesh: TriangleMesh, n_turns: int, n_shifts: int, has_camera: bool
) -> None:
    bone = BoneModel(name, mesh)
    scene, pose = surface_scene(bone, has_camera=has_camera)
    found = register(scene, RegistrationModel(bone), pose)
    assert found.outcome is Outcome.DEGENERATE, found.reasons
    assert found.reasons[0] is Reason.DEGENERATE
    words = [text.split(" (")[0] for text in found.details]
    assert words.count("not fixed: rotation about") == n_turns
    assert words.count("not fixed: translation along") == n_shifts


def test_a_pose_with_a_free_direction_has_no_predicted_error() -> None:
    bone = BoneModel("plane", grid_mesh(lambda x, y: 0.0 * x))
    scene, pose = surface_scene(bone, has_camera=True)
    found = register(scene, RegistrationModel(bone), pose)
    assert found.predicted_tre_mm is None
    assert found.reasons[-1] is Reason.POSE_UNCERTAIN


@pytest.mark.parametrize("mesh", few_of([ball_mesh(30.0, 2500), tube_mesh(25.0, 40.0)]))
def test_a_simple_surface_is_never_a_registration(mesh: TriangleMesh) -> None:
    bone = BoneModel("shape", mesh)
    for has_camera in (True, False):
        scene, pose = surface_scene(bone, has_camera=has_camera)
        found = register(scene, RegistrationModel(bone), pose)
        assert found.outcome is not Outcome.CONVERGED
        assert found.reasons


def meagre_scenes() -> dict[str, np.ndarray]:
    points = seen_scene(600, 0.3).points_mm
    middle = points.mean(axis=0)
    rng = np.random.default_rng(1)
    along = np.linspace(-30.0, 30.0, 200)[:, None]
    return {
        "empty": np.empty((0, 3)),
        "one point": points[:1],
        "a point many times": np.tile(points[:1], (200, 1)),
        "two points many times": np.tile(points[:2], (100, 1)),
        "a line": middle + along * (1.0, 0.2, 0.1),
        "a plane": middle + rng.uniform(-30.0, 30.0, (500, 3)) * (1.0, 1.0, 0.0),
        "far away": points + np.array([0.0, 5000.0, 0.0]),
        "in metres": points / 1000.0,
    }


@pytest.mark.release
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", meagre_scenes())
def test_a_meagre_scene_has_a_reason_and_is_never_a_registration(name: str, method) -> None:
    points = meagre_scenes()[name]
    small = RegistrationModel(blob())
    middle = RigidTransform.from_parts("left_rect", "femur", TRUE.rotation, (0.0, 0.0, 470.0))
    for camera in (EYE, None):
        found = register(Scene(points, camera), small, middle, method)
        assert found.outcome is not Outcome.CONVERGED
        assert found.reasons
        assert len(set(found.reasons)) == len(found.reasons)
        if name in ("empty", "one point"):
            assert found.reasons == (Reason.TOO_FEW_POINTS,)


@pytest.mark.parametrize("name", few_of(meagre_scenes(), 2))
def test_a_search_everywhere_makes_no_more_of_a_meagre_scene(name: str) -> None:
    scene = Scene(meagre_scenes()[name], EYE)
    if name == "far away":
        # Everywhere is everywhere: the same shape elsewhere is the bone.
        assert register(scene, MODEL, TRUE, is_global=True).outcome is Outcome.CONVERGED
        return
    found = register(scene, MODEL, TRUE, is_global=True)
    assert found.outcome is not Outcome.CONVERGED
    assert found.reasons
    assert len(set(found.reasons)) == len(found.reasons)


def test_points_that_nobody_measured_break_nothing() -> None:
    """Depth cameras write unknown points as zeros: where the camera stands."""
    scene = seen_scene(900, 0.3)
    points = np.concatenate([scene.points_mm, np.zeros((50, 3))])
    found = register(Scene(points, EYE), MODEL, disturbed(MODEL, 5.0, 4.0, 1))
    assert found.outcome is Outcome.CONVERGED
    assert mean_error_mm(found.estimate.camera_from_bone, BONE) < 0.25


def test_little_of_a_bone_is_too_little() -> None:
    """A patch that lies on the bone at a wrong place too."""
    points = seen_scene(3000, 0.2).points_mm
    nearest = np.argsort(np.linalg.norm(points - points[0], axis=1))[:150]
    found = register(Scene(points[nearest], EYE), MODEL, TRUE)
    assert found.outcome is not Outcome.CONVERGED
    assert found.reasons


def test_two_runs_are_equal_to_the_last_bit() -> None:
    start = disturbed(MODEL, 45.0, 20.0, 1)
    runs = [register(seen_scene(900, 0.4, 1, 600), MODEL, start, is_global=True) for _ in range(2)]
    first, second = (run.estimate for run in runs)
    assert np.array_equal(first.camera_from_bone.matrix, second.camera_from_bone.matrix)
    assert np.array_equal(first.covariance, second.covariance)
    assert runs[0].coverage == runs[1].coverage


def test_the_caller_may_stop_the_search() -> None:
    class StoppedError(Exception):
        pass

    def stop(share: float) -> None:
        if share > 0.2:
            raise StoppedError

    with pytest.raises(StoppedError):
        register(seen_scene(900, 0.3), MODEL, TRUE, is_global=True, on_progress=stop)


def test_progress_only_grows() -> None:
    """Also where every round of starts is tried."""
    told: list[float] = []
    scene = Scene(np.random.default_rng(1).uniform(-60.0, 60.0, (300, 3)))
    register(scene, MODEL, TRUE, is_global=True, on_progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert max(np.diff(told)) < 0.2


def test_the_error_is_predicted_over_what_faces_the_camera() -> None:
    scene = seen_scene(900, 0.3)
    found = register(scene, MODEL, TRUE)
    pose = found.estimate.camera_from_bone
    placed, normals = pose.apply(MODEL.points_mm), pose.rotate(MODEL.normals)
    cosine = -(placed * normals).sum(axis=1) / np.linalg.norm(placed, axis=1)
    seen = MODEL.points_mm[cosine > 0.2]
    assert 0.1 * len(placed) < len(seen) < 0.6 * len(placed)
    expected_mm = found.estimate.predict_tre_mm(MODEL.centre_mm, seen)
    assert found.predicted_tre_mm == pytest.approx(expected_mm, rel=0.01)
    everywhere_mm = found.estimate.predict_tre_mm(MODEL.centre_mm, MODEL.points_mm)
    assert found.predicted_tre_mm != pytest.approx(everywhere_mm, rel=0.015)


def test_a_pose_that_is_fixed_too_loosely_is_none() -> None:
    """Few and noisy points on a small part fix all six directions, but badly."""
    points = seen_scene(3000, 0.9).points_mm
    near = np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[:150]
    found = register(Scene(points[near], None), MODEL, TRUE)
    assert found.outcome is not Outcome.CONVERGED
    assert found.predicted_tre_mm is not None
    assert found.predicted_tre_mm > 2.0
    assert Reason.POSE_UNCERTAIN in found.reasons


def test_what_is_smaller_than_a_kernel_fits_everywhere() -> None:
    points = seen_scene(900, 0.0).points_mm
    tiny = points.mean(axis=0) + 0.02 * (points - points.mean(axis=0))
    found = register(Scene(tiny), MODEL, TRUE)
    assert found.outcome is Outcome.FAILED
    assert Reason.SIZE_DIFFERS in found.reasons
    assert "the scene is too small to fix a bone" in found.details


@pytest.mark.parametrize("seed", few_of(range(4)))
def test_a_scene_that_holds_no_bone_is_no_registration(seed: int) -> None:
    """A noisy sheet lies against a bone's flank well enough: its residuals are no noise."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-1.0, 1.0, (600, 2)) * (40.0, 12.0)
    off_mm = np.column_stack([place, rng.normal(-25.0, 0.3, 600)])
    sheet = TRUE.apply(MODEL.centre_mm) + off_mm
    for camera in (EYE, None):
        found = register(Scene(sheet, camera), MODEL, disturbed(MODEL, 10.0, 8.0, seed))
        assert found.outcome is not Outcome.CONVERGED


@pytest.mark.parametrize("rough_mm", [0.15, 0.3])
def test_a_rough_ball_is_as_degenerate_as_a_smooth_one(rough_mm: float) -> None:
    """The normals of a rough model look as if they fixed a rotation."""
    rng = np.random.default_rng(3)
    ball = ball_mesh(30.0, 4000)
    vertices = ball.vertices_mm * (1.0 + rough_mm / 30.0 * rng.standard_normal((4000, 1)))
    model = RegistrationModel(BoneModel("ball", TriangleMesh(vertices, ball.faces)))
    pose = RigidTransform.from_parts("left_rect", "ball", np.eye(3), (0.0, 0.0, 400.0))
    seen = ball.vertices_mm[ball.vertices_mm[:, 2] < -10.0]
    scene = Scene(pose.apply(seen) + rng.normal(0.0, 0.3, seen.shape), EYE)
    start = pose.move((1.0, -1.0, 2.0, 0.1, 0.05, -0.1), pose.translation_mm)
    assert register(scene, model, start).outcome is Outcome.DEGENERATE


def test_a_stray_point_far_away_changes_nothing() -> None:
    scene = seen_scene(1200, 0.4, 1)
    start = disturbed(MODEL, 25.0, 15.0, 1)
    strayed = Scene(np.vstack([scene.points_mm, [[3000.0, 0.0, 900.0]]]), EYE)
    found = register(strayed, MODEL, start)
    assert found.outcome is Outcome.CONVERGED
    assert found.coverage > 0.85
    assert mean_error_mm(found.estimate.camera_from_bone, BONE) < 0.25
