import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_angle_deg, rotation_from_vector
from sim_devices.hand import Hand

GRIP_MM = np.array([80.0, 60.0, 0.0])
S = 1_000_000_000


def pose(x: float = 0.0, z: float = 450.0, turn: tuple[float, float, float] = (0, 0, 0)):
    return RigidTransform.from_parts("left", "sheet", rotation_from_vector(turn), (x, 0.0, z))


def grip(hand: Hand, time_s: float) -> np.ndarray:
    return hand.left_from_body(round(time_s * S)).apply(GRIP_MM)


def test_a_pose_is_reached_nearly_and_in_a_hands_time():
    hand = Hand(pose(), GRIP_MM, seed=4)
    hand.left_from_body(0)
    hand.move_to(pose(100.0, 400.0, (0.3, 0.0, 0.0)))
    on_the_way, there = hand.left_from_body(S // 5), hand.left_from_body(2 * S)
    wanted = pose(100.0, 400.0, (0.3, 0.0, 0.0))
    off_mm = np.linalg.norm(there.apply(GRIP_MM) - wanted.apply(GRIP_MM))
    assert 0.2 < off_mm < 12.0
    assert 0.1 < rotation_angle_deg(there, wanted) < 6.0
    assert np.linalg.norm(on_the_way.apply(GRIP_MM) - wanted.apply(GRIP_MM)) > 20.0


def test_it_trembles_and_the_same_seed_trembles_alike():
    hands = [Hand(pose(), GRIP_MM, seed=seed) for seed in (1, 1, 2)]
    tracks = [np.array([grip(hand, t / 15) for t in range(30)]) for hand in hands]
    assert np.array_equal(tracks[0], tracks[1])
    assert not np.array_equal(tracks[0], tracks[2])
    assert 0.005 < np.ptp(tracks[0], axis=0).max() < 0.3


def test_a_nudge_goes_on_from_where_the_hand_wants_to_be():
    hand = Hand(pose(), GRIP_MM)
    hand.nudge((10.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    hand.nudge((10.0, 0.0, 0.0), (0.0, 0.0, 0.1))
    there = hand.left_from_body(5 * S)
    assert (there.apply(GRIP_MM) - pose().apply(GRIP_MM))[0] == pytest.approx(20.0, abs=0.2)
    assert rotation_angle_deg(there, pose()) == pytest.approx(np.degrees(0.1), abs=0.1)


def test_it_does_not_jump_when_it_is_told_otherwise_on_its_way():
    hand = Hand(pose(), GRIP_MM)
    hand.left_from_body(0)
    hand.move_to(pose(200.0))
    before = grip(hand, 0.3)
    hand.move_to(pose(-200.0))
    assert np.linalg.norm(grip(hand, 0.3) - before) < 0.1


def test_it_stays_in_front_of_the_cameras():
    hand = Hand(pose(), GRIP_MM)
    hand.nudge((0.0, 0.0, -400.0), (0.0, 0.0, 0.0))
    assert grip(hand, 5.0)[2] == pytest.approx(450.0, abs=0.2)
