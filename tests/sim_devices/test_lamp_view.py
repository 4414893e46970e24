import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_from_vector
from sim_devices.lamp_view import LampView

CAMERA_FROM_LAMPS = RigidTransform.from_parts(
    "camera", "table", rotation_from_vector((0.4, -0.5, 0.2)), (30.0, -20.0, 500.0)
)
# In the table's frame z is up; lamps of other lengths and strengths than one.
LAMPS = np.array([[0.0, 0.8, 2.0, 0.9], [0.5, 0.0, 0.6, 0.3]])
# An edge of a step in a plane, so deep (mm) on the side of larger x.
STEP_MM, REACH_MM = 6.0, 9.0


def strip(x0, x1, z):
    corners = np.array([[x0, -150.0, z], [x1, -150.0, z], [x1, 150.0, z], [x0, 150.0, z]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


def view_of(parts, is_static):
    return LampView([p[0] for p in parts], [p[1] for p in parts], is_static, LAMPS)


def behind_mm(surroundings, points_mm):
    """How far points (N, 3) of the table lie behind their surroundings."""
    m = surroundings.map_from_camera.astype(float)
    column, row, depth_mm = m[:, :3] @ CAMERA_FROM_LAMPS.apply(points_mm).T + m[:, 3:]
    mean = np.pad(surroundings.depth_mm.astype(float), ((0, 1), (0, 1)), mode="edge")
    c = np.clip(np.floor(column), 0, mean.shape[1] - 2).astype(int)
    r = np.clip(np.floor(row), 0, mean.shape[0] - 2).astype(int)
    x, y = column - c, row - r
    top = mean[r, c] * (1 - x) + mean[r, c + 1] * x
    bottom = mean[r + 1, c] * (1 - x) + mean[r + 1, c + 1] * x
    return depth_mm - (top * (1 - y) + bottom * y)


def mean_direction():
    unit = LAMPS[:, :3] / np.linalg.norm(LAMPS[:, :3], axis=1, keepdims=True)
    direction = unit.T @ LAMPS[:, 3]
    return direction / np.linalg.norm(direction)


def test_a_step_stands_out_as_a_smoothed_edge_along_the_lamps_light():
    """Against the plane's own slope, the mean over a Gaussian of the two half planes."""
    from scipy.stats import norm

    parts = [strip(20.0, 150.0, 0.0), strip(-150.0, 20.0, -STEP_MM)]
    poses = [CAMERA_FROM_LAMPS.rename("camera", "body")] * 2
    found = view_of(parts, [False, False]).draw(poses, CAMERA_FROM_LAMPS, static=False)
    light = mean_direction()
    # The light comes from larger x: below the edge it does not reach a strip of the lower side.
    x = np.linspace(-20.0, 60.0, 41)
    upper, lower = x > 20.0, x < 20.0 - STEP_MM * light[0] / light[2] - 0.1
    deeper_mm = STEP_MM / light[2]
    across = np.cross((0.0, 1.0, 0.0), light)  # square to the light and to the edge
    across /= np.linalg.norm(across)
    points = np.column_stack([x, np.full(41, 10.0), np.where(upper, 0.0, -STEP_MM)])
    share_upper = norm.cdf((points - (20.0, 10.0, 0.0)) @ across / REACH_MM)
    expected = deeper_mm * np.where(upper, share_upper - 1.0, share_upper)
    error = behind_mm(found, points)[upper | lower] - expected[upper | lower]
    assert np.abs(error).max() < 0.1 * deeper_mm


def test_static_parts_are_kept_and_moving_ones_come_on_top():
    wall, slab = strip(-150.0, 150.0, 0.0), strip(-30.0, 30.0, 20.0)
    pose = CAMERA_FROM_LAMPS.rename("camera", "body")
    view = view_of([wall, slab], [True, False])
    alone = view.draw([pose, pose], CAMERA_FROM_LAMPS, static=True)
    both = view.draw([pose, pose], CAMERA_FROM_LAMPS, static=False)
    at_once = view_of([wall, slab], [False, False]).draw(
        [pose, pose], CAMERA_FROM_LAMPS, static=False
    )
    assert np.abs(behind_mm(alone, np.zeros((1, 3)))).max() < 0.05
    assert behind_mm(both, np.zeros((1, 3)))[0] > 10.0
    points = np.random.default_rng(1).uniform(-70.0, 70.0, (100, 3))
    np.testing.assert_allclose(behind_mm(both, points), behind_mm(at_once, points), atol=1e-3)


@pytest.mark.parametrize("turn_rad", [0.0, np.pi])
def test_what_the_lamps_do_not_see_darkens_nothing(turn_rad):
    turned = RigidTransform.from_parts(
        "table", "body", rotation_from_vector((turn_rad, 0.0, 0.0)), (0.0, 0.0, 40.0)
    )
    pose = CAMERA_FROM_LAMPS @ turned
    found = view_of([strip(-40.0, 40.0, 0.0)], [False]).draw(
        [pose], CAMERA_FROM_LAMPS, static=False
    )
    assert behind_mm(found, np.array([[0.0, 0.0, 40.0]]))[0] < 0.05
