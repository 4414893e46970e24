import numpy as np
import pytest

from navapp.registration import Scene
from tests.registration.shapes import femur, seen_cloud

POINTS = np.random.default_rng(1).uniform(-30.0, 30.0, (500, 3)) + np.array([0.0, 0.0, 400.0])


def test_a_stereo_cloud_is_seen_from_the_origin_and_says_how_exact_it_is() -> None:
    cloud = seen_cloud(femur(), 300, 0.2)
    scene = Scene.from_stereo(cloud, 1.0)
    assert len(scene) == 300
    assert scene.knows_noise
    assert scene.arrays.has_camera
    np.testing.assert_array_equal(scene.arrays.camera, 0.0)
    np.testing.assert_array_equal(scene.arrays.sigma_ray, cloud.sigma_ray_mm)
    np.testing.assert_array_equal(scene.arrays.points, cloud.points_mm)


@pytest.mark.parametrize(
    ("correlation_px", "stride_px", "sharing"), [(12.0, 3, 16.0), (5.0, 5, 1.0), (2.0, 6, 1.0)]
)
def test_points_within_the_correlation_share_their_errors(
    correlation_px: float, stride_px: int, sharing: float
) -> None:
    cloud = seen_cloud(femur(), 100, 0.2)
    cloud = type(cloud)(cloud.points_mm, cloud.sigma_ray_mm, cloud.pixels, cloud.origin, stride_px)
    assert Scene.from_stereo(cloud, correlation_px).n_sharing_errors == pytest.approx(sharing)


def test_without_a_camera_and_a_sigma_the_kernels_are_told_so() -> None:
    scene = Scene(POINTS)
    assert not scene.knows_noise
    assert not scene.arrays.has_camera
    np.testing.assert_array_equal(scene.arrays.sigma_ray, np.zeros(500))


def test_the_search_from_far_uses_about_so_many_points() -> None:
    assert Scene(POINTS, thinned_to=500).every == 1
    assert Scene(POINTS, thinned_to=499).every == 2
    assert Scene(POINTS, thinned_to=100).every == 5
    assert Scene(np.empty((0, 3))).every == 1


def test_the_grid_holds_every_point_that_is_used_and_a_margin() -> None:
    scene = Scene(POINTS, thinned_to=250)
    grid = scene.grid
    top = grid.origin + grid.voxel * (np.array(grid.nearest.shape) - 1)
    assert (POINTS[::2].min(axis=0) - grid.origin >= 6.0 - 1e-9).all()
    assert (top - POINTS[::2].max(axis=0) >= 6.0 - 1e-9).all()
    assert set(grid.nearest[grid.nearest >= 0].ravel()) <= set(range(0, 500, 2))


def test_clutter_far_away_makes_the_voxels_larger_not_more() -> None:
    far = np.concatenate([POINTS, [[1e6, 0.0, 0.0]]])
    grid = Scene(far).grid
    assert max(grid.nearest.shape) <= 66
    assert grid.voxel > 1e4


def test_any_layout_of_the_points_is_read() -> None:
    scene = Scene(np.asfortranarray(POINTS.astype(np.float32)))
    assert scene.arrays.points.flags.c_contiguous
    assert scene.arrays.points.dtype == np.float64
    np.testing.assert_allclose(scene.arrays.points, POINTS, rtol=1e-6)
