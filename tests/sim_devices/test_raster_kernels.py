import numpy as np
import pytest

from sim_devices.raster_kernels import project_vertices, raster_triangles
from tests.reference import raster_reference

CAMERA = np.array(
    [
        700.0,
        705.0,
        31.0,
        24.0,
        -0.11,
        0.07,
        4e-4,
        -3e-4,
        0.02,
        0.01,
        -0.02,
        0.03,
        1e-3,
        2e-3,
        -1e-3,
        3e-3,
    ]
)


def rastered(screen, faces, width=64, height=48, box=None):
    inverse_depth = np.zeros((height, width), dtype=np.float32)
    triangle = np.full((height, width), -1, dtype=np.int32)
    box = np.array([0, 0, width, height] if box is None else box, dtype=np.int64)
    raster_triangles(screen, faces, 0, box, inverse_depth, triangle)
    return inverse_depth, triangle


def random_soup(seed, count=60):
    rng = np.random.default_rng(seed)
    screen = np.column_stack(
        [
            rng.uniform(-20, 84, 3 * count),
            rng.uniform(-20, 68, 3 * count),
            rng.uniform(0.001, 0.01, 3 * count),
        ]
    )
    return screen, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


@pytest.mark.kernel
def test_projection_agrees_with_opencv():
    rng = np.random.default_rng(1)
    points = rng.uniform(-200, 200, (500, 3))
    pose = np.column_stack([np.eye(3)[[1, 2, 0]], [10.0, -20.0, 600.0]])
    screen, bounds = np.empty((500, 3)), np.empty(4)
    project_vertices(points, pose, CAMERA, screen, bounds)
    expected = raster_reference.project(points, pose, CAMERA)
    assert np.abs(screen[:, :2] - expected[:, :2]).max() < 1e-6
    assert np.abs(screen[:, 2] - expected[:, 2]).max() < 1e-12
    np.testing.assert_array_equal(bounds[:2], screen[:, :2].min(axis=0))
    np.testing.assert_array_equal(bounds[2:], screen[:, :2].max(axis=0))


def test_a_vertex_behind_the_camera_is_marked_and_its_triangles_are_not_drawn():
    points = np.array([[0.0, 0.0, -5.0], [0.0, 30.0, 500.0], [30.0, 0.0, 500.0]])
    screen = np.empty((3, 3))
    project_vertices(points, np.eye(4)[:3], CAMERA, screen, np.empty(4))
    assert screen[0, 2] == 0.0
    assert (screen[1:, 2] > 0.0).all()
    assert (rastered(screen, np.array([[0, 1, 2]], dtype=np.int32))[1] == -1).all()


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(4))
def test_raster_agrees_with_the_reference(seed):
    screen, faces = random_soup(seed)
    inverse_depth, triangle = rastered(screen, faces)
    expected_inverse_depth, expected_triangle = raster_reference.raster(screen, faces, 64, 48)
    assert (triangle >= 0).mean() > 0.5
    np.testing.assert_array_equal(triangle, expected_triangle)
    np.testing.assert_allclose(inverse_depth, expected_inverse_depth, rtol=1e-6)


def test_nothing_is_drawn_outside_the_box():
    screen, faces = random_soup(7)
    whole, _ = rastered(screen, faces)
    part, _ = rastered(screen, faces, box=[10, 5, 40, 30])
    np.testing.assert_array_equal(part[5:30, 10:40], whole[5:30, 10:40])
    part[5:30, 10:40] = 0.0
    assert (part == 0.0).all()


def test_neighbours_leave_no_seam():
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.linspace(-5, 70, 12), np.linspace(-5, 55, 10))
    x, y = x + rng.uniform(-1.5, 1.5, x.shape), y + rng.uniform(-1.5, 1.5, y.shape)
    screen = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.002)])
    index = np.arange(x.size, dtype=np.int32).reshape(x.shape)
    a, b, c, d = (
        part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:])
    )
    faces = np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    _, triangle = rastered(screen, faces)
    assert (triangle[2:-2, 2:-2] >= 0).all()
