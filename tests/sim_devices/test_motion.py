import numpy as np
import pytest

from sim_devices.motion import (
    JUMP_AT_S,
    JUMP_DEG,
    JUMP_MM,
    JUMP_TAKES_S,
    SWEEP_PERIOD_S,
    LegMotion,
    compute_drill_motion,
    compute_sweep_offset_mm,
    smooth_step,
)
from tests.many import few_of

FRAME_S = 1.0 / 15.0


def sampled(kind, seed, seconds=40.0):
    motion = LegMotion(kind, seed)
    twists = np.array([motion.twist(t) for t in np.arange(0.0, seconds, FRAME_S)])
    return (
        np.linalg.norm(twists[:, :3], axis=1),
        np.degrees(np.linalg.norm(twists[:, 3:], axis=1)),
        twists,
    )


@pytest.mark.parametrize("kind", ["still", "breathing", "patient", "jump"])
def test_every_motion_starts_at_rest_position(kind):
    motion = LegMotion(kind, 3)
    np.testing.assert_array_equal(motion.twist(0.0), 0.0)
    assert motion.bend_rad(0.0) == 0.0


def test_still_is_still():
    shift, turn, _ = sampled("still", 1)
    assert shift.max() == 0.0
    assert turn.max() == 0.0


@pytest.mark.parametrize("seed", few_of(range(5), 2))
def test_breathing_stays_below_a_millimetre(seed):
    shift, turn, _ = sampled("breathing", seed)
    assert 0.2 < shift.max() < 1.0
    assert turn.max() < 0.5


@pytest.mark.parametrize("seed", few_of(range(5), 2))
def test_a_patient_moves_fast_smoothly_and_returns(seed):
    shift, turn, twists = sampled("patient", seed)
    steps = np.diff(twists, axis=0)
    assert 0.8 < np.linalg.norm(steps[:, :3], axis=1).max() < 2.0
    assert 0.6 < np.degrees(np.linalg.norm(steps[:, 3:], axis=1)).max() < 1.5
    # Smooth: the speed changes by little from frame to frame.
    assert np.linalg.norm(np.diff(steps[:, :3], axis=0), axis=1).max() < 0.5
    assert shift[150:].min() < 0.3 * shift.max()
    assert turn.max() < 10.0


def test_a_jump_is_one_step():
    motion = LegMotion("jump", 2)
    np.testing.assert_array_equal(motion.twist(JUMP_AT_S), 0.0)
    done = motion.twist(JUMP_AT_S + JUMP_TAKES_S)
    assert np.linalg.norm(done[:3]) == pytest.approx(JUMP_MM)
    assert np.degrees(np.linalg.norm(done[3:])) == pytest.approx(JUMP_DEG)
    np.testing.assert_array_equal(motion.twist(100.0), done)


def test_seeds_change_the_direction():
    assert not np.allclose(LegMotion("patient", 1).twist(1.2), LegMotion("patient", 2).twist(1.2))


def test_the_hand_comes_and_goes_with_its_period():
    distance = [
        np.linalg.norm(compute_sweep_offset_mm("sweep", t))
        for t in np.linspace(0, SWEEP_PERIOD_S, 61)
    ]
    assert min(distance) < 40.0
    assert distance[0] > 300.0
    np.testing.assert_allclose(
        compute_sweep_offset_mm("sweep", 2.5),
        compute_sweep_offset_mm("sweep", 2.5 + SWEEP_PERIOD_S),
        atol=1e-9,
    )
    np.testing.assert_array_equal(
        compute_sweep_offset_mm("none", 2.5), compute_sweep_offset_mm("none", 0.0)
    )


def test_the_drill_points_along_the_hole_turns_and_is_in_it_at_times():
    entry, axis = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.6, 0.8])
    depths = []
    for t in np.linspace(0.0, 5.0, 50):
        pose = compute_drill_motion(entry, axis, t, turns=True)
        np.testing.assert_allclose(pose[:3, 2], axis, atol=1e-12)
        offset = pose[:3, 3] - entry
        depths.append(offset @ axis)
        if depths[-1] > 0.0:
            np.testing.assert_allclose(offset, depths[-1] * axis, atol=1e-9)
    assert max(depths) == pytest.approx(18.0)
    assert min(depths) < -30.0
    still = compute_drill_motion(entry, axis, 0.1, turns=False)
    assert not np.allclose(compute_drill_motion(entry, axis, 0.1, turns=True)[:3, 0], still[:3, 0])


def test_smooth_step_has_flat_ends():
    assert smooth_step(-1.0) == 0.0
    assert smooth_step(2.0) == 1.0
    assert smooth_step(0.5) == pytest.approx(0.5)
    assert smooth_step(0.01) < 1e-4
