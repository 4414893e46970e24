import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_angle_deg
from navapp.registration import (
    RegistrationModel,
    Scene,
    distinct,
    find_poses,
    is_same_pose,
)
from navapp.registration.multi_start import (
    compute_coverage,
    compute_explained_fraction,
    find_distinct,
    make_tilted_starts,
)
from navapp.values import BoneModel
from tests.registration.shapes import (
    TRUE,
    disturbed,
    facing_points,
    femur,
    femur_for_registration,
    grid_mesh,
    mean_error_mm,
    seen_scene,
)

BONE = femur()
MODEL = femur_for_registration()
EYE = np.zeros(3)
SCENE = seen_scene(900, 0.2)


def test_the_starts_are_the_pose_and_tilts_about_the_centre() -> None:
    centre = TRUE.apply(MODEL.centre_mm)
    starts = make_tilted_starts(TRUE, centre, (15.0, 12))
    assert len(starts) == 13
    assert starts[0] is TRUE
    for start in starts[1:]:
        assert rotation_angle_deg(start, TRUE) == pytest.approx(15.0)
        np.testing.assert_allclose(start.apply(MODEL.centre_mm), centre, atol=1e-9)


def test_the_tilts_go_in_all_directions() -> None:
    starts = make_tilted_starts(TRUE, TRUE.apply(MODEL.centre_mm), (15.0, 12))[1:]
    angles = [rotation_angle_deg(a, b) for i, a in enumerate(starts) for b in starts[:i]]
    assert min(angles) > 8.0
    turns = np.array([(s.rotation @ TRUE.rotation.T)[[2, 0, 1], [1, 2, 0]] for s in starts])
    assert np.ptp(turns, axis=0).min() > 0.35


def test_the_same_answer_is_kept_once_and_the_first_stays() -> None:
    near = disturbed(MODEL, 0.5, 0.5, 1)
    shifted, turned = disturbed(MODEL, 0.0, 3.0, 1), disturbed(MODEL, 4.0, 0.0, 1)
    kept = distinct([TRUE, near, shifted, turned, near], MODEL.centre_mm)
    assert [id(k) for k in kept] == [id(TRUE), id(shifted), id(turned)]


def test_how_near_repeats_an_earlier_pose_may_be_said() -> None:
    moved = ((10.0, 0.0), (0.0, 9.0), (20.0, 0.0), (0.0, 90.0), (18.0, 90.0))
    poses = [TRUE, *(disturbed(MODEL, *one, 1) for one in moved)]
    rotations = np.array([pose.rotation for pose in poses])
    centres_mm = np.array([pose.apply(MODEL.centre_mm) for pose in poses])
    assert find_distinct(rotations, centres_mm, 12.0, 15.0) == [0, 3, 4, 5]


def test_sameness_has_its_bounds() -> None:
    assert is_same_pose(TRUE, disturbed(MODEL, 1.9, 0.0, 2), MODEL.centre_mm)
    assert not is_same_pose(TRUE, disturbed(MODEL, 2.2, 0.0, 2), MODEL.centre_mm)
    assert is_same_pose(TRUE, disturbed(MODEL, 0.0, 1.9, 2), MODEL.centre_mm)
    assert not is_same_pose(TRUE, disturbed(MODEL, 0.0, 2.1, 2), MODEL.centre_mm)


def minus_error(pose: RigidTransform) -> float:
    return -mean_error_mm(pose, BONE)


def test_candidates_are_distinct_and_the_best_comes_first() -> None:
    centre = TRUE.apply(MODEL.centre_mm)
    starts = [disturbed(MODEL, 60.0, 5.0, 3), *make_tilted_starts(TRUE, centre, (10.0, 5))]
    found = find_poses(SCENE, MODEL, starts, minus_error)
    scores = [candidate.score for candidate in found]
    assert scores == sorted(scores, reverse=True)
    assert scores == [minus_error(candidate.scene_from_bone) for candidate in found]
    assert mean_error_mm(found[0].scene_from_bone, BONE) < 1.0
    poses = [candidate.scene_from_bone for candidate in found]
    assert len(distinct(poses, MODEL.centre_mm)) == len(found) < len(starts)


def test_what_a_pose_explains_finds_the_right_one_among_the_candidates() -> None:
    centre = SCENE.points_mm.mean(axis=0)
    starts = make_tilted_starts(disturbed(MODEL, 25.0, 10.0, 4), centre, (35.0, 14))
    found = find_poses(seen_scene(900, 0.3, 1, 600), MODEL, starts)
    assert mean_error_mm(found[0].scene_from_bone, BONE) < 1.0
    assert all(0.0 <= candidate.score <= 1.0 for candidate in found)


def test_a_start_that_pairs_with_nothing_gives_no_candidate() -> None:
    far = TRUE.move([300.0, 0, 0, 0, 0, 0], TRUE.translation_mm)
    assert find_poses(SCENE, MODEL, [far]) == []
    assert find_poses(SCENE, MODEL, []) == []


def test_two_runs_on_two_threads_are_equal_to_the_last_bit() -> None:
    starts = make_tilted_starts(
        disturbed(MODEL, 20.0, 8.0, 5), SCENE.points_mm.mean(axis=0), (35.0, 14)
    )
    runs = [find_poses(seen_scene(900, 0.3, 2, 600), MODEL, starts) for _ in range(2)]
    assert len(runs[0]) == len(runs[1]) > 0
    for a, b in zip(*runs, strict=True):
        assert np.array_equal(a.scene_from_bone.matrix, b.scene_from_bone.matrix)
        assert a.score == b.score


def test_a_pose_explains_the_share_of_the_scene_that_lies_on_it() -> None:
    clean = Scene(SCENE.points_mm)
    all_of_it = compute_explained_fraction(clean, MODEL, TRUE)
    assert all_of_it > 0.95
    cluttered = seen_scene(900, 0.2, 0, 900)
    half = compute_explained_fraction(Scene(cluttered.points_mm), MODEL, TRUE)
    assert 0.45 < half < 0.65
    # With a camera the share of the model that was seen counts as well.
    points = SCENE.points_mm
    part = points[points[:, 0] < np.median(points[:, 0])]
    assert compute_explained_fraction(Scene(part), MODEL, TRUE) > 0.95
    assert compute_explained_fraction(Scene(part, np.zeros(3)), MODEL, TRUE) < 0.7
    assert (
        compute_explained_fraction(SCENE, MODEL, disturbed(MODEL, 20.0, 10.0, 1)) < 0.5 * all_of_it
    )


def test_progress_grows_to_one() -> None:
    told: list[float] = []
    find_poses(SCENE, MODEL, [TRUE] * 4, minus_error, told.append)
    assert told == [0.0, 0.5, 1.0]


def test_progress_may_stop_the_search() -> None:
    class StoppedError(Exception):
        pass

    told: list[float] = []

    def stop(share: float) -> None:
        told.append(share)
        if len(told) == 2:
            raise StoppedError

    with pytest.raises(StoppedError):
        find_poses(SCENE, MODEL, [TRUE] * 10, minus_error, stop)
    assert len(told) == 2


def test_a_bone_that_is_seen_whole_is_covered_at_its_pose() -> None:
    points = facing_points(femur(), TRUE)
    assert compute_coverage(Scene(points, EYE), MODEL, TRUE, 0.5) > 0.93


def test_half_of_what_should_be_seen_is_half() -> None:
    points = facing_points(femur(), TRUE)
    half = points[points[:, 0] < np.median(points[:, 0])]
    found = compute_coverage(Scene(half, EYE), MODEL, TRUE, 0.5)
    assert 0.4 < found < 0.68


def test_a_wrong_pose_is_covered_less() -> None:
    scene = seen_scene(1500, 0.3)
    right = compute_coverage(scene, MODEL, TRUE, 0.75)
    wrong = [compute_coverage(scene, MODEL, disturbed(MODEL, 30.0, 8.0, s), 0.75) for s in range(4)]
    assert right > 0.9
    assert max(wrong) < 0.7
    assert compute_coverage(scene, MODEL, disturbed(MODEL, 0.0, 300.0, 1), 0.75) == 0.0


def test_a_narrow_kernel_asks_for_a_near_surface() -> None:
    points = facing_points(femur(), TRUE)
    scene = Scene(points * (1.0 + 2.0 / 470.0), EYE)
    assert compute_coverage(scene, MODEL, TRUE, 3.0) > 0.9
    assert compute_coverage(scene, MODEL, TRUE, 0.5) < 0.2


def test_a_surface_that_turns_its_back_is_not_covered() -> None:
    model = RegistrationModel(BoneModel("plate", grid_mesh(lambda x, y: 0.0 * x)))
    pose = RigidTransform.from_parts(
        "left_rect", "plate", np.diag([1.0, -1.0, -1.0]), (0.0, 0.0, 400.0)
    )
    scene = Scene(pose.apply(model.points_mm), EYE)
    assert compute_coverage(scene, model, pose, 1.0) == 0.0
    front = RigidTransform.from_parts("left_rect", "plate", np.eye(3), (0.0, 0.0, 400.0))
    assert compute_coverage(scene, model, front, 1.0) == 1.0


def test_without_a_camera_there_is_no_coverage() -> None:
    scene = Scene(facing_points(femur(), TRUE))
    assert compute_coverage(scene, MODEL, TRUE, 0.5) is None
