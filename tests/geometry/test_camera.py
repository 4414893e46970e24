import cv2
import numpy as np
import pytest

from navapp.geometry.camera import Camera
from tests.geometry.shapes import STRONG, camera

COUNTS = (0, 4, 5, 8, 12)


def grid(width=640, height=480, n=25):
    u, v = np.meshgrid(np.linspace(0, width - 1, n), np.linspace(0, height - 1, n))
    return np.column_stack([u.ravel(), v.ravel()])


@pytest.mark.parametrize("count", COUNTS)
def test_projection_is_that_of_opencv(count):
    lens = camera(STRONG[:count])
    points = np.random.default_rng(count).uniform((-200, -150, 300), (200, 150, 700), (400, 3))
    expected, _ = cv2.projectPoints(
        points.reshape(-1, 1, 3),
        np.zeros(3),
        np.zeros(3),
        np.array(lens.matrix),
        STRONG[:count].reshape(1, -1) if count else None,
    )
    np.testing.assert_allclose(lens.project(points), expected.reshape(-1, 2), rtol=0, atol=1e-9)


def test_fourteen_coefficients_without_tilt_are_those_twelve():
    points = np.random.default_rng(3).uniform((-200, -150, 300), (200, 150, 700), (50, 3))
    np.testing.assert_array_equal(
        camera(np.r_[STRONG, 0.0, 0.0]).project(points), camera(STRONG).project(points)
    )


def test_a_tilted_sensor_is_refused():
    with pytest.raises(ValueError, match="tilted"):
        camera(np.r_[STRONG, 0.01, 0.0])


@pytest.mark.parametrize("count", COUNTS)
def test_rays_close_with_strong_distortion(count):
    lens = camera(STRONG[:count])
    assert (
        count == 0
        or np.abs(lens.project([[200.0, 150, 500]]) - camera().project([[200.0, 150, 500]])).max()
        > 5
    )
    rays = lens.rays(grid())
    np.testing.assert_array_equal(rays[:, 2], 1.0)
    np.testing.assert_allclose(lens.project(rays * 420.0), grid(), rtol=0, atol=1e-6)


def test_the_ray_through_the_centre_is_the_axis():
    lens = camera(STRONG)
    np.testing.assert_allclose(lens.rays([[321.5, 236.25]]), [[0.0, 0.0, 1.0]], atol=1e-12)


@pytest.mark.parametrize("factor", [0.25, 0.5, 2.0])
def test_a_resized_picture_sees_the_same_ray_through_the_same_corner(factor):
    lens = camera(STRONG[:5])
    small = lens.scale(factor)
    assert (small.width, small.height) == (round(640 * factor), round(480 * factor))
    # Corners of the picture lie at -0.5 and size - 0.5, at every size.
    corners = np.array([[-0.5, -0.5], [639.5, -0.5], [-0.5, 479.5], [639.5, 479.5], [99.5, 199.5]])
    same = factor * (corners + 0.5) - 0.5
    np.testing.assert_allclose(small.rays(same), lens.rays(corners), rtol=0, atol=1e-9)


def test_points_at_and_behind_the_camera_have_no_pixel():
    pixels = camera(STRONG).project([[0, 0, 0.0], [1, 1, -5.0], [0, 0, 100.0]])
    assert np.isnan(pixels[:2]).all()
    np.testing.assert_allclose(pixels[2], [321.5, 236.25])
    assert np.isnan(camera().project([[1.0, 2.0, -3.0]])).all()


def test_no_points_give_no_pixels_and_no_rays():
    assert camera(STRONG).project(np.empty((0, 3))).shape == (0, 2)
    assert camera(STRONG).rays(np.empty((0, 2))).shape == (0, 3)


@pytest.mark.parametrize(
    "matrix",
    [
        np.eye(2),
        np.full((3, 3), np.nan),
        np.diag([0.0, 700, 1]),
        np.diag([700.0, -700, 1]),
        np.diag([700.0, 700, 2]),
        np.array([[700, 0, 320], [0, 700, 240], [1e-3, 0, 1.0]]),
        np.array([[700, 0, 320], [2.0, 700, 240], [0, 0, 1.0]]),
    ],
)
def test_matrices_of_no_camera_are_refused(matrix):
    with pytest.raises(ValueError, match=r"camera matrix|focal"):
        Camera(matrix, np.zeros(5), 640, 480)


def test_a_skewed_matrix_is_refused_because_opencv_would_ignore_the_skew():
    with pytest.raises(ValueError, match="skew"):
        Camera(np.array([[700, 3.0, 320], [0, 700, 240], [0, 0, 1]]), np.zeros(5), 640, 480)


@pytest.mark.parametrize("distortion", [np.zeros(3), np.zeros(6), np.zeros(13), [np.nan] * 5])
def test_distortions_of_no_lens_are_refused(distortion):
    with pytest.raises(ValueError, match="distortion needs"):
        camera(distortion)


@pytest.mark.parametrize("size", [(0, 480), (640, -1)])
def test_pictures_without_pixels_are_refused(size):
    with pytest.raises(ValueError, match="positive"):
        camera((), *size)


def test_bad_point_shapes_are_refused():
    with pytest.raises(ValueError, match="reshape"):
        camera().project(np.zeros((4, 2)))


def test_opencv_row_of_coefficients_is_taken():
    assert camera(STRONG.reshape(1, -1)).distortion.shape == (12,)
    assert camera(STRONG).is_distorted
    assert not camera(np.zeros(5)).is_distorted
    assert camera().focal_px == pytest.approx(703.5)
