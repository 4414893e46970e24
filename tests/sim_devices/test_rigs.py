import numpy as np
import pytest

from navapp.geometry.rectification import Rectifier
from navapp.geometry.transform import RigidTransform, rotation_angle_deg
from sim_devices.rigs import (
    BASELINE_MM,
    TOE_IN_DEG,
    WORKING_DISTANCE_MM,
    camera_from_left,
    make_default_rig,
)


def test_the_rig_has_the_promised_size_baseline_and_focal_length():
    rig = make_default_rig()
    assert (rig.width, rig.height) == (1280, 720)
    assert rig.baseline_mm == pytest.approx(BASELINE_MM)
    assert rig.left.focal_px == pytest.approx(1400.0, rel=0.01)
    assert rig.serials == ("SIM-L", "SIM-R")
    assert rig.name.startswith("sim:")
    assert rig.left.is_distorted
    assert rig.right.is_distorted
    turned = rotation_angle_deg(rig.right_from_left, RigidTransform.identity("right", "left"))
    assert turned == pytest.approx(2.0 * TOE_IN_DEG, abs=0.1)


def test_another_baseline_changes_the_distance_of_the_cameras_and_nothing_else():
    usual, wide = make_default_rig(), make_default_rig(baseline_mm=120.0)
    assert wide.baseline_mm == pytest.approx(120.0)
    np.testing.assert_array_equal(wide.right_from_left.rotation, usual.right_from_left.rotation)
    np.testing.assert_allclose(
        wide.right_from_left.translation_mm, 1.5 * usual.right_from_left.translation_mm
    )
    assert make_default_rig(baseline_mm=BASELINE_MM).rig_id == usual.rig_id


def test_the_cameras_converge():
    rig = make_default_rig()
    axis_of_right = rig.right_from_left.rotation[2]
    assert axis_of_right[0] < -0.05


def test_the_rig_can_be_rectified_and_sees_the_working_distance_inside_the_pictures():
    geometry = Rectifier(make_default_rig()).geometry
    assert 150.0 < geometry.disparity_px(WORKING_DISTANCE_MM) < 300.0


def test_another_size_is_the_same_rig_scaled():
    half = make_default_rig(640, 360)
    np.testing.assert_allclose(half.left.matrix, make_default_rig().scale(0.5).left.matrix)
    assert (half.width, half.height) == (640, 360)


def test_another_shape_is_refused():
    with pytest.raises(ValueError, match="16:9"):
        make_default_rig(640, 480)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_turned_right_eye_shows_everything_elsewhere(axis: int) -> None:
    """About x its picture moves across the rows, about y along them; the left one stays."""
    rig, turn = make_default_rig(), [0.0, 0.0, 0.0]
    turn[axis] = np.radians(0.02)
    point = np.array([[5.0, -8.0, 450.0]])
    before = rig.right.project(rig.right_from_left.apply(point))
    after = rig.right.project(camera_from_left(rig, "right", tuple(turn)).apply(point))
    moved = np.abs(after - before)[0]
    assert moved[1 - axis] == pytest.approx(1398.0 * turn[axis], rel=0.02)
    assert moved[axis] < 0.02
    assert np.array_equal(camera_from_left(rig, "left", tuple(turn)).matrix, np.eye(4))
