import numpy as np
import pytest

from navapp.registration import Scene
from tests.registration.shapes import femur, seen_cloud

POINTS = np.random.default_rng(1).uniform(-30.0, 30.0, (500, 3)) + np.array([0.0, 0.0, 400.0])


def rows(points: np.ndarray, sigma: np.ndarray) -> set[tuple[float, ...]]:
    return {tuple(row) for row in np.column_stack([points, sigma])}


def test_a_stereo_cloud_is_seen_from_the_origin_and_says_how_exact_it_is() -> None:
    cloud = seen_cloud(femur(), 300, 0.2)
    scene = Scene.from_stereo(cloud, 1.0)
    assert len(scene) == 300
    assert scene.knows_noise
    assert scene.arrays.has_camera
    np.testing.assert_array_equal(scene.arrays.camera, 0.0)
    assert rows(scene.arrays.points, scene.arrays.sigma_ray) == rows(
        cloud.points_mm, cloud.sigma_ray_mm
    )


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
    used = scene.arrays.points[::2]
    assert (used.min(axis=0) - grid.origin >= 6.0 - 1e-9).all()
    assert (top - used.max(axis=0) >= 6.0 - 1e-9).all()
    assert set(grid.nearest[grid.nearest >= 0].ravel()) <= set(range(0, 500, 2))


@pytest.mark.parametrize("away_mm", [2e3, 1e6])
def test_what_lies_far_away_changes_nothing_where_the_scene_is(away_mm: float) -> None:
    grid = Scene(np.concatenate([POINTS, [[away_mm, 0.0, 0.0]]])).grid
    assert max(grid.nearest.shape) <= 66
    assert grid.voxel == Scene(POINTS).grid.voxel
    assert len(np.unique(grid.nearest)) > 20


def test_points_written_in_rows_are_thinned_all_over() -> None:
    """Every n-th of a picture's points would be a few of its columns."""
    x, y = np.meshgrid(np.arange(8.0), np.arange(100.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(800)])
    scene = Scene(points, thinned_to=200)
    assert scene.every == 4
    assert len(np.unique(scene.arrays.points[::4, 0])) == 8


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_points_that_are_not_finite_are_refused(bad: float) -> None:
    points = POINTS.copy()
    points[3, 1] = bad
    with pytest.raises(ValueError, match="finite"):
        Scene(points)


def test_any_layout_of_the_points_is_read() -> None:
    scene = Scene(np.asfortranarray(POINTS.astype(np.float32)))
    assert scene.arrays.points.flags.c_contiguous
    assert scene.arrays.points.dtype == np.float64
    np.testing.assert_allclose(
        np.sort(scene.arrays.points, axis=0), np.sort(POINTS, axis=0), rtol=1e-6
    )


def test_of_the_points_that_thinning_keeps_and_of_the_others_neighbours_stay_neighbours() -> None:
    numbered = Scene(POINTS, sigma_ray_mm=np.arange(500.0), thinned_to=100)
    order = numbered.arrays.sigma_ray
    kept, others = order[:: numbered.every], np.delete(order, slice(None, None, numbered.every))
    assert (np.diff(kept) > 0.0).all()
    assert (np.diff(others) > 0.0).all()
    # They are no rows: steps between them are of all sizes.
    assert len(np.unique(np.diff(kept))) > 5
