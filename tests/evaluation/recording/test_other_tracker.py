from dataclasses import replace

import numpy as np
import pytest

from navapp.errors import ResultError
from navapp.evaluation.recording.other_tracker import SolvedFrames, find_poses, solve_frames
from navapp.evaluation.recording.tracker_motion import TrackerMotion, split_halves
from navapp.evaluation.recording.truth_files import TrackerTruth
from tests.evaluation.tracked_twice import (
    CENTRE_MM,
    LEFT_FROM_TRACKER,
    MARKER_FROM_BONE,
    OFFSET_NS,
    VERTICES_MM,
    TrackedTwice,
    hinging,
    track_twice,
    waving,
)


def solve(data: TrackedTwice) -> SolvedFrames:
    return solve_frames(data.times_ns, data.poses, data.truth, VERTICES_MM)


def errors_mm(solved: SolvedFrames, data: TrackedTwice) -> list[float]:
    """Of the truth that was made, against the truth."""
    return [
        float(np.linalg.norm(pose.apply(VERTICES_MM) - true.apply(VERTICES_MM), axis=1).mean())
        for pose, true in zip(find_poses(solved, data.truth, data.times_ns), data.true, strict=True)
        if pose is not None
    ]


@pytest.mark.release
def test_frames_and_offset_without_noise() -> None:
    data = track_twice(noise=0.0)
    solved = solve(data)
    assert abs(solved.offset_ns - OFFSET_NS) < 50_000
    centre = MARKER_FROM_BONE.apply(CENTRE_MM)
    assert solved.marker_from_bone.apply(CENTRE_MM) == pytest.approx(centre, abs=0.01)
    turn = solved.left_from_tracker.rotation.T @ LEFT_FROM_TRACKER.rotation
    assert turn == pytest.approx(np.eye(3), abs=1e-4)
    assert max(errors_mm(solved, data)) < 0.02


@pytest.mark.release
def test_frames_and_offset_with_noise() -> None:
    data = track_twice(seconds=40.0)
    solved = solve(data)
    assert abs(solved.offset_ns - OFFSET_NS) < 2_000_000
    # The marker's own noise reaches the bone: 0.03 degrees over 125 mm, beside 0.1 mm an axis.
    assert np.mean(errors_mm(solved, data)) < 0.25
    assert 0.1 < solved.fit_mm < 0.4
    assert 0.005 < solved.frames_sd_mm < 0.15
    assert 0.05 < solved.offset_sd_ms < 2.0


@pytest.mark.release
def test_what_the_solve_says_of_its_uncertainty_is_what_it_scatters_by() -> None:
    offs, told = [], []
    for seed in range(6):
        solved = solve(track_twice(seconds=20.0, seed=seed))
        offs.append((solved.offset_ns - OFFSET_NS) * 1e-6)
        told.append(solved.offset_sd_ms)
    assert 0.3 < np.sqrt(np.mean(np.square(offs))) / np.mean(told) < 3.0


@pytest.mark.release
def test_no_picture_is_both_solved_with_and_scored() -> None:
    data = track_twice()
    solved = solve(data)
    assert not set(solved.solved_with) & set(solved.scored)
    known = find_poses(solved, data.truth, data.times_ns)
    assert [n for n, pose in enumerate(known) if pose is not None] == list(solved.scored)
    times_s = (np.array(data.times_ns) - data.times_ns[0]) * 1e-9
    gap_s = times_s[list(solved.scored)][:, None] - times_s[list(solved.solved_with)]
    assert np.abs(gap_s).min() > 0.15


def test_the_solve_never_sees_the_half_that_is_scored() -> None:
    data = track_twice()
    solved = solve(data)
    rng = np.random.default_rng(5)
    since_s = (data.truth.times_ns - OFFSET_NS - data.times_ns[0]) * 1e-9
    halves = split_halves((np.array(data.times_ns) - data.times_ns[0]) * 1e-9)
    blocks = np.floor(since_s).astype(int)
    scored = np.isin(blocks, np.unique(halves.blocks[halves.is_to_score]))
    matrices = data.truth.matrices.copy()
    matrices[scored, :3, 3] += rng.normal(0.0, 3.0, (int(scored.sum()), 3))
    poses = list(data.poses)
    for n in np.flatnonzero(~halves.is_to_solve):
        poses[n] = data.true[n].move([4.0, -3.0, 2.0, 0.1, 0.0, 0.0], np.zeros(3))
    changed = replace(data, poses=poses, truth=replace(data.truth, matrices=matrices))
    again = solve(changed)
    assert again.offset_ns == solved.offset_ns
    assert np.array_equal(again.marker_from_bone.matrix, solved.marker_from_bone.matrix)
    assert np.array_equal(again.left_from_tracker.matrix, solved.left_from_tracker.matrix)
    assert np.mean(errors_mm(again, changed)) > 2.0


def test_a_wrong_pose_here_and_there_does_not_turn_the_frames() -> None:
    data = track_twice(seconds=30.0)
    poses = list(data.poses)
    for n in range(5, len(poses), 40):
        poses[n] = data.true[n].move([0.0, 15.0, 0.0, 0.0, 0.2, 0.0], np.zeros(3))
    solved = solve(replace(data, poses=poses))
    assert np.mean(errors_mm(solved, data)) < 0.3


@pytest.mark.release
def test_what_the_tracker_did_not_see_is_not_scored() -> None:
    data = track_twice(seconds=30.0)
    since_s = (data.truth.times_ns - OFFSET_NS - data.times_ns[0]) * 1e-9
    kept = (since_s < 10.0) | (since_s > 14.0)
    truth = TrackerTruth(data.truth.times_ns[kept], data.truth.matrices[kept])
    solved = solve(replace(data, truth=truth))
    seconds = {n // 15 for n in solved.scored}
    assert len(seconds) >= 12
    assert not seconds & {11, 12, 13}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (lambda: track_twice(hinging), "about a second, at least 1 is"),
        (lambda: track_twice(lambda s: (np.zeros(3), waving(s)[1])), "about a second"),
        (lambda: track_twice(lambda s: waving(s % 5.0), seconds=30.0), "repeats itself"),
        (lambda: track_twice(seconds=3.0), "are needed"),
    ],
    ids=["one axis", "no turn", "periodic", "short"],
)
def test_what_determines_nothing_is_refused(data, words) -> None:
    with pytest.raises(ResultError, match="cannot be solved") as error:
        solve(data())
    assert words in error.value.problem
    assert "turned to and fro" in error.value.remedy


@pytest.mark.release
def test_a_tracker_of_another_recording_is_refused() -> None:
    data = track_twice()
    other = track_twice(lambda s: waving(2.3 * s + 100.0))
    with pytest.raises(ResultError, match="differ by"):
        solve(replace(data, truth=other.truth))


def test_a_tracker_that_ran_only_a_moment_is_refused() -> None:
    data = track_twice()
    truth = TrackerTruth(data.truth.times_ns[:80], data.truth.matrices[:80])
    with pytest.raises(ResultError, match="no time offset"):
        solve(replace(data, truth=truth))


def test_between_samples_turns_follow_the_shorter_way() -> None:
    turned = np.array([np.eye(4), np.diag([-1.0, -1.0, 1.0, 1.0])])
    turned[1, :2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    turned[1, :3, 3] = [10.0, 0.0, 4.0]
    motion = TrackerMotion(TrackerTruth(np.array([0, 100_000_000]), turned))
    rotations, places_mm = motion.at(np.array([0.05]))
    half = np.sqrt(0.5)
    assert rotations[0] == pytest.approx(np.array([[half, -half, 0], [half, half, 0], [0, 0, 1]]))
    assert places_mm[0] == pytest.approx([5.0, 0.0, 2.0])
    assert motion.knows(np.array([-0.01, 0.05, 0.11])).tolist() == [False, True, False]
