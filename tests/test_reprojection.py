import numpy as np
import pytest

from navapp.values import DisparityMap, Origin
from tests.stereo.pairs import geometry

pytestmark = pytest.mark.kernel


def a_map(height: int = 30, width: int = 40) -> DisparityMap:
    rng = np.random.default_rng(3)
    disparity = rng.uniform(30.0, 60.0, (height, width)).astype(np.float32)
    sigma = rng.uniform(0.1, 0.5, (height, width)).astype(np.float32)
    return DisparityMap(
        disparity, sigma, np.full((height, width), Origin.MATCHED, dtype=np.uint8), 110, 25
    )


def test_points_project_back_to_their_pixels_with_their_disparity() -> None:
    given, geo = a_map(), geometry()
    cloud = given.reproject(geo)
    assert len(cloud) == given.disparity_px.size
    np.testing.assert_allclose(geo.project(cloud.points_mm), cloud.pixels, atol=1e-9)
    disparity = geo.focal_px * geo.baseline_mm / cloud.points_mm[:, 2]
    rows, columns = cloud.pixels[:, 1] - given.y, cloud.pixels[:, 0] - given.x
    np.testing.assert_allclose(disparity, given.disparity_px[rows, columns], rtol=1e-9)
    assert cloud.pixels.min(axis=0).tolist() == [110, 25]


def test_sigma_is_how_far_the_point_moves_along_its_ray() -> None:
    given, geo = a_map(), geometry()
    cloud = given.reproject(geo)
    step = np.float32(1e-2)
    further = DisparityMap(
        given.disparity_px + step, given.sigma_px, given.origin, given.x, given.y
    )
    moved = further.reproject(geo)
    slope = np.linalg.norm(moved.points_mm - cloud.points_mm, axis=1) / step
    sigma_px = given.sigma_px[cloud.pixels[:, 1] - given.y, cloud.pixels[:, 0] - given.x]
    np.testing.assert_allclose(cloud.sigma_ray_mm, slope * sigma_px, rtol=2e-3)


@pytest.mark.parametrize("stride", [2, 3, 7])
def test_stride_takes_every_nth_pixel_each_way(stride: int) -> None:
    given = a_map()
    cloud = given.reproject(geometry(), stride)
    expected = {(110 + c, 25 + r) for r in range(0, 30, stride) for c in range(0, 40, stride)}
    assert {tuple(pixel) for pixel in cloud.pixels.tolist()} == expected


def test_only_the_wanted_origins_become_points() -> None:
    given = a_map()
    given.origin[:10] = Origin.FILLED_INTERIOR
    given.origin[10:15] = Origin.FILLED_BORDER
    assert len(given.reproject(geometry())) == 15 * 40
    wanted = (Origin.MATCHED, Origin.FILLED_INTERIOR)
    cloud = given.reproject(geometry(), origins=wanted)
    assert set(cloud.origin.tolist()) == {int(origin) for origin in wanted}
    assert len(cloud) == 25 * 40


@pytest.mark.parametrize("value", [np.nan, 0.0, -4.0])
def test_what_is_no_distance_gives_no_point(value: float) -> None:
    given = a_map()
    given.disparity_px[:, :] = value
    cloud = given.reproject(geometry())
    assert len(cloud) == 0
    assert cloud.points_mm.shape == (0, 3)
