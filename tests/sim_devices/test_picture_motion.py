import math

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from sim_devices.picture_motion import compute_path_px
from tests.sim_devices.plain_world import plain_rig

CAMERA = plain_rig().left  # 64 x 48 px, focal length 80 px
MS = 1_000_000


def at(x_mm, z_mm=400.0):
    return RigidTransform.from_parts("left", "body", np.eye(3), (x_mm, 0.0, z_mm))


def test_the_nearest_point_moves_farthest():
    points_mm = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -200.0]])
    path_px = compute_path_px(CAMERA, points_mm, lambda t: at(5e-6 * t), 0, 2 * MS)
    assert path_px == pytest.approx(80.0 * 10.0 / 200.0)


def test_to_and_fro_counts_both_ways():
    points_mm = np.zeros((1, 3))
    path_px = compute_path_px(
        CAMERA, points_mm, lambda t: at(10.0 * math.sin(math.pi * t / MS)), 0, MS
    )
    assert path_px == pytest.approx(2.0 * 80.0 * 10.0 / 400.0)


@pytest.mark.parametrize("point_mm", [(900.0, 0.0, 0.0), (0.0, 0.0, -500.0)])
def test_what_is_not_in_view_does_not_count(point_mm):
    points_mm = np.array([point_mm])
    assert compute_path_px(CAMERA, points_mm, lambda t: at(5e-6 * t), 0, 2 * MS) == 0.0
