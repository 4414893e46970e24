import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_angle_deg
from sim_devices.shake import ARM_MM, ArmShake

QUARTER_S = 1.0 / 32.0  # of a period of 8 Hz


def place_mm(pose):
    return pose.inverse().translation_mm


def test_without_amplitude_nothing_moves():
    still = ArmShake(0.0, 8.0, 3)
    assert still.is_still
    np.testing.assert_array_equal(still.left_from_rest(QUARTER_S).matrix, np.eye(4))
    assert still.compute_speed_px_s(1400.0, 450.0) == 0.0


def test_the_rig_swings_by_its_amplitude_and_turns_as_the_arm_does():
    shake = ArmShake(0.3, 8.0, 3)
    assert not shake.is_still
    rest = RigidTransform.identity("left", "left")
    np.testing.assert_array_equal(shake.left_from_rest(0.0).matrix, rest.matrix)
    there, back = (shake.left_from_rest(k * QUARTER_S) for k in (1, 3))
    assert np.linalg.norm(place_mm(there)) == pytest.approx(0.3)
    np.testing.assert_allclose(place_mm(back), -place_mm(there), atol=1e-9)
    assert np.radians(rotation_angle_deg(there, rest)) == pytest.approx(0.3 / ARM_MM, rel=1e-4)


def test_the_seed_chooses_the_direction():
    first, same, other = (ArmShake(0.3, 8.0, seed).left_from_rest(QUARTER_S) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.matrix, same.matrix)
    assert np.linalg.norm(first.translation_mm - other.translation_mm) > 0.05


def test_no_point_moves_faster_in_the_picture_than_told():
    depth_mm, focal_px, step_s = 450.0, 1400.0, 1e-4
    speeds_px_s = []
    for seed in range(12):
        shake = ArmShake(0.3, 8.0, seed)
        points = [shake.left_from_rest(t).apply((0.0, 0.0, depth_mm)) for t in (0.0, step_s)]
        pixels = [focal_px * point[:2] / point[2] for point in points]
        speeds_px_s.append(float(np.linalg.norm(pixels[1] - pixels[0])) / step_s)
    told_px_s = ArmShake(0.3, 8.0, 0).compute_speed_px_s(focal_px, depth_mm)
    assert 0.4 * told_px_s < max(speeds_px_s) <= told_px_s
