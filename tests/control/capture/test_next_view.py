"""Wishes from marks: nothing of the true rig is known but what the marks say."""

import numpy as np
import pytest

from navapp.control.capture.next_view import N_STARTING, plan_next_view, starting_view
from navapp.geometry.transform import rotation_angle_deg
from tests.calibration.marks import BOARD, HEIGHT, WIDTH, drawn_pairs, drawn_rig, seen_pair

SIZE, DEPTH_MM = (WIDTH, HEIGHT), (350.0, 550.0)


def test_both_cameras_see_every_starting_view_of_any_rig():
    for seed in range(8):
        rng = np.random.default_rng(seed)
        rig = drawn_rig(rng)
        for number in range(N_STARTING):
            pair = seen_pair(number, rig, starting_view(BOARD, number, DEPTH_MM), rng)
            assert len(pair.common()[0]) >= 20


def test_starting_views_differ():
    poses = [starting_view(BOARD, number, DEPTH_MM) for number in range(N_STARTING)]
    angles = [rotation_angle_deg(poses[a], poses[b]) for a in range(4) for b in range(a)]
    assert min(angles) > 20.0


def test_before_there_is_a_rig_the_starting_views_are_asked_for():
    pairs = drawn_pairs(drawn_rig(np.random.default_rng(1)), np.random.default_rng(1), 3)
    for n in range(N_STARTING):
        next_view = plan_next_view(BOARD, pairs[:n], SIZE, DEPTH_MM)
        assert next_view.rig is None
        assert next_view.bound_mm is None
        assert np.array_equal(
            next_view.left_from_board.matrix, starting_view(BOARD, n, DEPTH_MM).matrix
        )


@pytest.mark.release
def test_a_wished_view_is_worth_more_than_another_one():
    rng = np.random.default_rng(7)
    rig = drawn_rig(rng)
    pairs = drawn_pairs(rig, rng, 8)
    next_view = plan_next_view(BOARD, pairs, SIZE, DEPTH_MM)
    wished = seen_pair(8, rig, next_view.left_from_board, rng)
    again = [*pairs, wished]
    bound = plan_next_view(BOARD, again, SIZE, DEPTH_MM, next_view).bound_mm
    others = [
        plan_next_view(BOARD, [*pairs, other], SIZE, DEPTH_MM, next_view).bound_mm
        for other in (replaced(one) for one in drawn_pairs(rig, rng, 6))
    ]
    assert bound < next_view.bound_mm
    assert bound < np.median(others)


def replaced(pair):
    return type(pair)(8, pair.left, pair.right)


@pytest.mark.release
def test_going_on_from_the_last_solve_and_beginning_anew_agree():
    rng = np.random.default_rng(9)
    pairs = drawn_pairs(drawn_rig(rng), rng, 10)
    last = plan_next_view(BOARD, pairs[:9], SIZE, DEPTH_MM)
    on, anew = (plan_next_view(BOARD, pairs, SIZE, DEPTH_MM, one) for one in (last, None))
    assert on.bound_mm == pytest.approx(anew.bound_mm, rel=1e-3)
    assert on.rig.baseline_mm == pytest.approx(anew.rig.baseline_mm, abs=1e-3)
    assert on.indices == tuple(range(10))


def test_views_that_explain_no_rig_ask_for_the_starting_views_again():
    rng = np.random.default_rng(2)
    rig = drawn_rig(rng)
    same = [seen_pair(k, rig, starting_view(BOARD, 0, DEPTH_MM), rng) for k in range(4)]
    next_view = plan_next_view(BOARD, same, SIZE, DEPTH_MM)
    assert next_view.left_from_board is not None
    assert next_view.bound_mm is None or next_view.bound_mm > 0.5


def test_turns_that_cannot_be_had_are_not_asked_for():
    rng = np.random.default_rng(7)
    pairs = drawn_pairs(drawn_rig(rng), rng, 6)
    next_view = plan_next_view(BOARD, pairs, SIZE, DEPTH_MM)
    avoid = [next_view.left_from_board.rotation]
    other = plan_next_view(BOARD, pairs, SIZE, DEPTH_MM, next_view, avoid)
    assert rotation_angle_deg(other.left_from_board, next_view.left_from_board) > 10.0
