from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import rotation_angle_deg
from navapp.registration import RegistrationModel, distinct, find_candidates, tilted_starts
from navapp.registration.initial import is_same_pose
from navapp.registration.point_to_plane import estimate_at
from tests.registration.shapes import TRUE, disturbed, femur, mean_error_mm, seen_cloud

BONE = femur()
MODEL = RegistrationModel(BONE)
CLOUD = seen_cloud(BONE, 900, 0.2)


def test_the_starts_are_the_pose_and_tilts_about_the_centre() -> None:
    starts = tilted_starts(TRUE, MODEL.centre_mm, 15.0, 12)
    assert len(starts) == 13
    assert starts[0] is TRUE
    centre = TRUE.apply(MODEL.centre_mm)
    for start in starts[1:]:
        assert rotation_angle_deg(start, TRUE) == pytest.approx(15.0)
        np.testing.assert_allclose(start.apply(MODEL.centre_mm), centre, atol=1e-9)


def test_the_tilts_go_in_all_directions() -> None:
    starts = tilted_starts(TRUE, MODEL.centre_mm, 15.0, 12)[1:]
    angles = [rotation_angle_deg(a, b) for i, a in enumerate(starts) for b in starts[:i]]
    assert min(angles) > 8.0
    turns = np.array([(s.rotation @ TRUE.rotation.T)[[2, 0, 1], [1, 2, 0]] for s in starts])
    assert np.ptp(turns, axis=0).min() > 0.35


def test_the_same_answer_is_kept_once_and_the_first_stays() -> None:
    first = estimate_at(CLOUD, MODEL, TRUE)
    near = replace(first, camera_from_bone=disturbed(MODEL, 0.5, 0.5, 1))
    shifted = replace(first, camera_from_bone=disturbed(MODEL, 0.0, 3.0, 1))
    turned = replace(first, camera_from_bone=disturbed(MODEL, 4.0, 0.0, 1))
    kept = distinct([first, near, shifted, turned, near], MODEL.centre_mm)
    assert [id(k) for k in kept] == [id(first), id(shifted), id(turned)]


def test_sameness_has_its_bounds() -> None:
    assert is_same_pose(TRUE, disturbed(MODEL, 1.9, 0.0, 2), MODEL.centre_mm)
    assert not is_same_pose(TRUE, disturbed(MODEL, 2.2, 0.0, 2), MODEL.centre_mm)
    assert is_same_pose(TRUE, disturbed(MODEL, 0.0, 1.9, 2), MODEL.centre_mm)
    assert not is_same_pose(TRUE, disturbed(MODEL, 0.0, 2.1, 2), MODEL.centre_mm)


def score(estimate) -> float:
    return -mean_error_mm(estimate.camera_from_bone, BONE)


def test_candidates_are_distinct_and_the_best_comes_first() -> None:
    starts = [disturbed(MODEL, 60.0, 5.0, 3), *tilted_starts(TRUE, MODEL.centre_mm, 10.0, 5)]
    found = find_candidates(CLOUD, MODEL, starts, score)
    scores = [score(estimate) for estimate in found]
    assert scores == sorted(scores, reverse=True)
    assert mean_error_mm(found[0].camera_from_bone, BONE) < 1.0
    assert len(distinct(found, MODEL.centre_mm)) == len(found) < len(starts)


def test_a_start_that_pairs_with_nothing_gives_no_candidate() -> None:
    far = TRUE.moved([300.0, 0, 0, 0, 0, 0], TRUE.translation_mm)
    assert find_candidates(CLOUD, MODEL, [far], score) == []


def test_progress_grows_to_one() -> None:
    told: list[float] = []
    find_candidates(CLOUD, MODEL, [TRUE] * 4, score, told.append)
    assert told == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_progress_may_stop_the_search() -> None:
    class StoppedError(Exception):
        pass

    told: list[float] = []

    def stop(share: float) -> None:
        told.append(share)
        if len(told) == 2:
            raise StoppedError

    with pytest.raises(StoppedError):
        find_candidates(CLOUD, MODEL, [TRUE] * 10, score, stop)
    assert len(told) == 2
