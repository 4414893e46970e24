import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_angle_deg
from navapp.registration import (
    Scene,
    compute_explained_fraction,
    distinct,
    find_poses,
    is_same_pose,
    make_tilted_starts,
)
from tests.registration.shapes import (
    TRUE,
    disturbed,
    femur,
    femur_for_registration,
    mean_error_mm,
    seen_scene,
)

BONE = femur()
MODEL = femur_for_registration()
SCENE = seen_scene(900, 0.2)


def test_the_starts_are_the_pose_and_tilts_about_the_centre() -> None:
    centre = TRUE.apply(MODEL.centre_mm)
    starts = make_tilted_starts(TRUE, centre, 15.0, 12)
    assert len(starts) == 13
    assert starts[0] is TRUE
    for start in starts[1:]:
        assert rotation_angle_deg(start, TRUE) == pytest.approx(15.0)
        np.testing.assert_allclose(start.apply(MODEL.centre_mm), centre, atol=1e-9)


def test_the_tilts_go_in_all_directions() -> None:
    starts = make_tilted_starts(TRUE, TRUE.apply(MODEL.centre_mm), 15.0, 12)[1:]
    angles = [rotation_angle_deg(a, b) for i, a in enumerate(starts) for b in starts[:i]]
    assert min(angles) > 8.0
    turns = np.array([(s.rotation @ TRUE.rotation.T)[[2, 0, 1], [1, 2, 0]] for s in starts])
    assert np.ptp(turns, axis=0).min() > 0.35


def test_the_same_answer_is_kept_once_and_the_first_stays() -> None:
    near = disturbed(MODEL, 0.5, 0.5, 1)
    shifted, turned = disturbed(MODEL, 0.0, 3.0, 1), disturbed(MODEL, 4.0, 0.0, 1)
    kept = distinct([TRUE, near, shifted, turned, near], MODEL.centre_mm)
    assert [id(k) for k in kept] == [id(TRUE), id(shifted), id(turned)]


def test_sameness_has_its_bounds() -> None:
    assert is_same_pose(TRUE, disturbed(MODEL, 1.9, 0.0, 2), MODEL.centre_mm)
    assert not is_same_pose(TRUE, disturbed(MODEL, 2.2, 0.0, 2), MODEL.centre_mm)
    assert is_same_pose(TRUE, disturbed(MODEL, 0.0, 1.9, 2), MODEL.centre_mm)
    assert not is_same_pose(TRUE, disturbed(MODEL, 0.0, 2.1, 2), MODEL.centre_mm)


def minus_error(pose: RigidTransform) -> float:
    return -mean_error_mm(pose, BONE)


def test_candidates_are_distinct_and_the_best_comes_first() -> None:
    centre = TRUE.apply(MODEL.centre_mm)
    starts = [disturbed(MODEL, 60.0, 5.0, 3), *make_tilted_starts(TRUE, centre, 10.0, 5)]
    found = find_poses(SCENE, MODEL, starts, minus_error)
    scores = [candidate.score for candidate in found]
    assert scores == sorted(scores, reverse=True)
    assert scores == [minus_error(candidate.scene_from_bone) for candidate in found]
    assert mean_error_mm(found[0].scene_from_bone, BONE) < 1.0
    poses = [candidate.scene_from_bone for candidate in found]
    assert len(distinct(poses, MODEL.centre_mm)) == len(found) < len(starts)


def test_what_a_pose_explains_finds_the_right_one_among_the_candidates() -> None:
    centre = SCENE.points_mm.mean(axis=0)
    starts = make_tilted_starts(disturbed(MODEL, 25.0, 10.0, 4), centre, 35.0, 14)
    found = find_poses(seen_scene(900, 0.3, 1, 600), MODEL, starts)
    assert mean_error_mm(found[0].scene_from_bone, BONE) < 1.0
    assert all(0.0 <= candidate.score <= 1.0 for candidate in found)


def test_a_start_that_pairs_with_nothing_gives_no_candidate() -> None:
    far = TRUE.move([300.0, 0, 0, 0, 0, 0], TRUE.translation_mm)
    assert find_poses(SCENE, MODEL, [far]) == []
    assert find_poses(SCENE, MODEL, []) == []


def test_two_runs_on_two_threads_are_equal_to_the_last_bit() -> None:
    starts = make_tilted_starts(
        disturbed(MODEL, 20.0, 8.0, 5), SCENE.points_mm.mean(axis=0), 35.0, 14
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
