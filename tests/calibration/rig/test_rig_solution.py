"""A rig solved from marks with noise, and what it says of itself."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.rig.acceptance import find_occupied_cells
from calibration.rig.dropped_pairs import Fault
from calibration.rig.rig_solution import solve_rig
from calibration.rig.uncertainty import make_working_points_mm
from calibration.targets.boards import parse_board
from calibration.targets.seen_pairs import SeenPair
from navapp.errors import ResultError
from navapp.geometry.triangulation import triangulate_mm
from tests.calibration.marks import (
    BOARD,
    HEIGHT,
    WIDTH,
    drawn_pairs,
    drawn_pose,
    drawn_rig,
    seen_pair,
)

SIZE = (WIDTH, HEIGHT)


def triangulation_error_mm(solved, true, points_mm):
    left = true.left.project(points_mm)
    right = true.right.project(true.right_from_left.apply(points_mm))
    return np.linalg.norm(triangulate_mm(solved, left, right) - points_mm, axis=1)


@pytest.fixture(scope="module")
def world():
    rng = np.random.default_rng(5)
    rig = drawn_rig(rng)
    return rig, drawn_pairs(rig, rng, 12, noise_px=0.02)


@pytest.fixture(scope="module")
def shares() -> list[float]:
    """Of the work on `solved`, as it was told."""
    return []


@pytest.fixture(scope="module")
def solved(world, shares):
    return solve_rig(BOARD, world[1], SIZE, on_progress=shares.append)


def test_the_rig_is_found_and_accepted(world, solved):
    true, _ = world
    assert solved.rig.quality is not None
    assert solved.rig.quality.is_accepted, solved.rig.quality.reasons
    assert solved.rig.baseline_mm == pytest.approx(true.baseline_mm, abs=0.05)
    assert solved.rig.left.matrix[0, 0] == pytest.approx(true.left.matrix[0, 0], rel=0.002)
    errors = triangulation_error_mm(solved.rig, true, solved.points_mm)
    assert np.median(errors) < np.median(solved.bounds_mm)
    # Noise in each coordinate leaves its length, less what was solved for.
    assert solved.solved.rms_px == pytest.approx(0.02 * 2**0.5, rel=0.1)
    assert solved.held_out_rms_px == pytest.approx(solved.solved.rms_px, rel=0.1)


@pytest.mark.release
@pytest.mark.parametrize("n_rigs", [2, 4])
def test_the_predicted_error_holds_over_many_rigs(n_rigs):
    errors, bounds = [], []
    for seed in range(n_rigs):
        rng = np.random.default_rng(1000 + seed)
        true = drawn_rig(rng)
        found = solve_rig(BOARD, drawn_pairs(true, rng, 10), SIZE)
        errors.append(triangulation_error_mm(found.rig, true, found.points_mm))
        bounds.append(found.bounds_mm)
    share = np.mean(np.concatenate(errors) < np.concatenate(bounds))
    assert share > 0.85
    assert np.median(np.concatenate(bounds)) < 4.0 * np.median(np.concatenate(errors))


@pytest.mark.release
def test_a_board_that_is_not_flat_is_solved_for():
    rng = np.random.default_rng(8)
    true = drawn_rig(rng)
    middle = BOARD.points_mm - BOARD.points_mm.mean(axis=0)
    off_mm = np.zeros_like(middle)
    off_mm[:, 2] = 1.2 * (1.0 - (middle[:, 0] / 75.0) ** 2)
    found = solve_rig(BOARD, drawn_pairs(true, rng, 12, off_mm=off_mm), SIZE)
    assert found.solved.model.n_marks == len(BOARD.points_mm)
    assert found.solved.rms_px < 0.08
    errors = triangulation_error_mm(found.rig, true, found.points_mm)
    assert np.median(errors) < np.median(found.bounds_mm)


def test_a_flat_board_is_not_bent_by_noise(solved):
    assert solved.solved.model.n_marks == 0


def reasons_of(pairs, **kwargs):
    found = solve_rig(kwargs.pop("board", BOARD), pairs, SIZE, **kwargs)
    assert found.rig.quality is not None
    return found, found.rig.quality.reasons


def test_too_few_views_are_refused(world):
    _, reasons = reasons_of(world[1][:6])
    assert any("only 6 pairs" in reason for reason in reasons)
    for n in (3, 0):
        with pytest.raises(ResultError, match=f"{n} usable pairs"):
            solve_rig(BOARD, world[1][:n], SIZE)


def test_frontal_views_are_refused(world):
    """At the picture's edges, where the line of sight meets the board aslant."""
    rng = np.random.default_rng(2)
    poses = [drawn_pose(rng, tilt_deg=3.0, aside_mm=200.0) for _ in range(16)]
    drawn = [seen_pair(i, world[0], pose, rng) for i, pose in enumerate(poses)]
    pairs = [pair for pair in drawn if min(len(pair.left.ids), len(pair.right.ids)) > 12]
    assert len(pairs) >= 14
    assert any("frontally" in reason for reason in reasons_of(pairs)[1])


def test_a_board_that_stays_in_the_middle_is_refused(world):
    rng = np.random.default_rng(3)
    small = parse_board(
        {
            "type": "charuco", "squares_x": 6, "squares_y": 5, "square_mm": 10.0,
            "marker_mm": 7.0, "dictionary": "DICT_4X4_100",
        }
    )  # fmt: skip
    pairs = [
        seen_pair(i, world[0], drawn_pose(rng, small, aside_mm=3.0), rng, board=small)
        for i in range(14)
    ]
    found, reasons = reasons_of(pairs, board=small)
    assert any("one part of the left picture" in reason for reason in reasons)
    # What both cameras see for certain is asked for without a hole.
    for number, side in enumerate(("left", "right")):
        marked = find_occupied_cells(
            np.vstack([getattr(pair, side).pixels for pair in found.pairs]), SIZE
        )
        assert (found.covered.bare[number] | marked)[1:5, 2:6].all()
        assert not (found.covered.bare[number] & marked).any()


def test_a_wrong_square_is_seen_by_a_known_distance(world):
    true, pairs = world
    wrong = replace(BOARD, spacing_mm=14.0, mark_mm=10.0)
    _, reasons = reasons_of(pairs, board=wrong, known_distance_mm=true.baseline_mm)
    assert any("not as large" in reason for reason in reasons)
    assert reasons_of(pairs, known_distance_mm=true.baseline_mm)[1] == ()


def test_swapped_cameras_are_refused(world):
    swapped = [SeenPair(pair.index, pair.right, pair.left) for pair in world[1]]
    assert any("swapped" in reason for reason in reasons_of(swapped)[1])


def test_pairs_out_of_order_are_refused_by_their_number(world):
    pairs = list(world[1])
    pairs[3], pairs[7] = (
        SeenPair(3, pairs[3].left, pairs[7].right),
        SeenPair(7, pairs[7].left, pairs[3].right),
    )
    found, reasons = reasons_of(pairs)
    assert {one.index for one in found.dropped} == {3, 7}
    assert {one.fault for one in found.dropped} == {Fault.OUT_OF_ORDER}
    assert any("pair 3" in reason and "pair 7" in reason for reason in reasons)


def test_a_blurred_view_is_dropped_and_the_rest_accepted(world):
    pairs = list(world[1])
    right = replace(pairs[5].right, blur_px=3.0)
    pairs[5] = SeenPair(5, pairs[5].left, right)
    found, reasons = reasons_of(pairs)
    assert [(one.index, one.fault) for one in found.dropped] == [(5, Fault.BLURRED)]
    assert reasons == ()


def test_a_board_that_moved_between_the_pictures_is_refused(world):
    rng = np.random.default_rng(4)
    pairs = list(world[1])
    pose = drawn_pose(rng)
    moved = pose.move((3.0, 1.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 450.0))
    pairs.append(seen_pair(99, world[0], pose, rng, moved_right=moved))
    found, reasons = reasons_of(pairs)
    assert [(one.index, one.fault) for one in found.dropped] == [(99, Fault.MOVED)]
    assert any("pair 99" in reason and "moved" in reason for reason in reasons)


@pytest.mark.release
def test_views_set_aside_judge(world):
    true, pairs = world
    rng = np.random.default_rng(6)
    aside = drawn_pairs(true, rng, 4, noise_px=0.02)
    found = solve_rig(BOARD, pairs, SIZE, aside=aside)
    assert found.held_out_rms_px == pytest.approx(0.02 * 2**0.5, rel=0.15)
    worse = [
        replace(one, left=replace(one.left, pixels=one.left.pixels + np.array([0.0, 2.0])))
        for one in aside
    ]
    _, reasons = reasons_of(pairs, aside=worse)
    assert any("held-out" in reason for reason in reasons)


def test_the_working_volume_is_what_both_cameras_see(world, solved):
    points_mm = make_working_points_mm(solved.solved.model, solved.solved.shared, (350.0, 550.0))
    rig = solved.rig
    for camera, seen in ((rig.left, points_mm), (rig.right, rig.right_from_left.apply(points_mm))):
        pixels = camera.project(seen)
        assert (pixels >= 0).all()
        assert (pixels < SIZE).all()
    assert points_mm[:, 2].min() == pytest.approx(350.0)


def test_progress_is_told_and_what_it_raises_stops_the_work(world, solved, shares):
    assert len(shares) > 2
    assert shares == sorted(shares)
    assert shares[-1] == 1.0

    def stop(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve_rig(BOARD, world[1], SIZE, on_progress=stop)
