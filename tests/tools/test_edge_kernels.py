"""Edges on lines across a picture, beside SciPy's fit and edges drawn at known places."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from navapp.geometry.transform import FloatArray
from navapp.tools.edge_kernels import BLUR_PX, STEP_PX, fit_edge, locate_edges, read_between
from tests.reference.edge_reference import edge_profile, edge_reference


def places_of(n: int) -> FloatArray:
    return np.asarray(STEP_PX * (np.arange(n) - 0.5 * (n - 1)), dtype=np.float64)


def fitted(greys: FloatArray) -> FloatArray:
    told = np.empty(3)
    fit_edge(np.ascontiguousarray(greys), told)
    return told


@pytest.mark.kernel
@pytest.mark.parametrize("n", [7, 11, 17])
def test_an_edge_is_fitted_as_its_reference_does(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(20):
        c, blur_px = rng.uniform(-0.8, 0.8), rng.uniform(0.6, 1.1)
        m, a = rng.uniform(80.0, 150.0), rng.choice([-1.0, 1.0]) * rng.uniform(20.0, 70.0)
        greys = np.rint(edge_profile(places_of(n), c, m, a, blur_px) + rng.normal(0.0, 1.0, n))
        expected = edge_reference(greys, STEP_PX, BLUR_PX)
        found = fitted(greys)
        # The fit ends with a step of less than a thousandth.
        assert found[0] == pytest.approx(expected[0], abs=2e-3)
        assert found[1] == pytest.approx(expected[1], abs=0.05)


@pytest.mark.kernel
def test_what_is_left_is_that_of_the_edge_that_is_told() -> None:
    rng = np.random.default_rng(7)
    for _ in range(20):
        c, a = rng.uniform(-0.8, 0.8), rng.uniform(20.0, 70.0)
        greys = edge_profile(places_of(7), c, 100.0, a, BLUR_PX) + rng.normal(0.0, 1.0, 7)
        expected = edge_reference(greys, STEP_PX, BLUR_PX)
        assert fitted(greys)[2] == pytest.approx(expected[2], abs=0.1)


@pytest.mark.parametrize("blur_px", [0.4, 0.8, 1.3])
def test_an_edge_of_another_blur_is_not_moved(blur_px: float) -> None:
    found = fitted(edge_profile(places_of(13), 0.0, 100.0, 50.0, blur_px))
    assert found[0] == pytest.approx(0.0, abs=1e-6)
    # What the fit leaves tells of the blur.
    assert (found[2] > 0.5) == (blur_px != BLUR_PX)


def test_the_half_contrast_has_the_sign_of_the_step() -> None:
    greys = edge_profile(places_of(11), 0.3, 100.0, 50.0, BLUR_PX)
    np.testing.assert_allclose(fitted(greys), [0.3, 50.0, 0.0], atol=0.01)
    np.testing.assert_allclose(fitted(greys[::-1]), [-0.3, -50.0, 0.0], atol=0.01)


def test_where_there_is_no_edge_there_is_no_number() -> None:
    assert np.isnan(fitted(np.full(11, 77.0))).all()
    beyond = edge_profile(places_of(7), 3.0, 100.0, 50.0, BLUR_PX)
    assert np.isnan(fitted(beyond)).all()


@pytest.mark.kernel
def test_grey_between_pixels_is_what_scipy_reads() -> None:
    rng = np.random.default_rng(4)
    picture = rng.integers(0, 256, (7, 9), dtype=np.uint8)
    places = np.column_stack([rng.uniform(0, 7.999, 50), rng.uniform(0, 5.999, 50)])
    expected = map_coordinates(picture.astype(float), places.T[::-1], order=1)
    found = [read_between(picture, x, y) for x, y in places]
    np.testing.assert_allclose(found, expected, atol=1e-9)
    for x, y in ((-0.01, 3.0), (3.0, -0.01), (8.0, 3.0), (3.0, 6.0), (np.nan, 3.0)):
        assert np.isnan(read_between(picture, x, y))


def slanted_picture(angle_rad: float, through_px: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """Black and white beside a straight edge, and its normal towards white."""
    normal = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    y, x = np.mgrid[0:40, 0:50].astype(float)
    away = (x - through_px[0]) * normal[0] + (y - through_px[1]) * normal[1]
    return np.rint(edge_profile(away, 0.0, 120.0, 70.0, BLUR_PX)).astype(np.uint8), normal


@pytest.mark.kernel
@pytest.mark.parametrize("angle_rad", [0.0, 0.4, 2.2, -1.3])
def test_an_edge_is_found_beside_the_expected_place(angle_rad: float) -> None:
    through = np.array([25.0, 20.0])
    picture, normal = slanted_picture(angle_rad, through)
    off_px = np.array([-0.7, -0.2, 0.0, 0.4, 0.9])
    along = np.array([-normal[1], normal[0]])
    places = through - off_px[:, None] * normal + np.linspace(-6.0, 6.0, 5)[:, None] * along
    # Looked along a slanted line: what is told is at right angles to the edge all the same.
    for slant in (0.0, 0.5):
        steps = np.tile(normal + slant * along, (5, 1))
        told = np.empty((5, 3))
        locate_edges(picture, places, steps, np.full(5, 4.0), told)
        np.testing.assert_allclose(told[:, 0], off_px, atol=0.03)
        # Four pixels between which is read blur a little more.
        np.testing.assert_allclose(told[:, 1], 70.0, rtol=0.05)


@pytest.mark.kernel
def test_nothing_is_told_beyond_the_picture_or_within_a_pixel() -> None:
    picture, normal = slanted_picture(0.0, np.array([25.0, 20.0]))
    places = np.array([[25.0, 20.0], [2.0, 20.0], [47.0, 20.0], [25.0, 39.5], [25.0, 20.0]])
    reach = np.array([4.0, 4.0, 4.0, 4.0, 1.4])
    told = np.zeros((5, 3))
    locate_edges(picture, places, np.tile(normal, (5, 1)), reach, told)
    assert np.isfinite(told[0]).all()
    assert np.isnan(told[1:]).all()


@pytest.mark.kernel
def test_a_reach_of_any_length_is_cut_to_what_is_held() -> None:
    picture = np.tile(np.rint(edge_profile(np.arange(200.0) - 100.0, 0.2, 99.0, 50.0, 0.8)), (9, 1))
    told = np.empty((1, 3))
    place, step = np.array([[100.0, 4.0]]), np.array([[1.0, 0.0]])
    locate_edges(picture.astype(np.uint8), place, step, np.array([90.0]), told)
    assert told[0, 0] == pytest.approx(0.2, abs=0.02)
