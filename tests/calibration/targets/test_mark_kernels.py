"""The kernels of marks against their equations."""

import numpy as np
import pytest
from scipy.linalg import sqrtm

from calibration.targets import circle_kernels, corner_kernels, mark_kernels
from calibration.targets.mark_kernels import compute_edge
from navapp.geometry.camera import Camera
from tests.reference import mark_reference

CORNER = np.array([0.3, -0.2, 0.1, 1.5, 0.8, 60.0, 120.0, 0.4, -0.3])
DISC = np.array([0.4, -0.6, 0.13, 0.01, 0.16, 0.7, -50.0, 130.0, 0.2, 0.5])
PLACES = [(-4.0, 1.0), (0.0, 0.0), (3.0, -5.0), (6.0, 2.0)]


def on_outline(angle: float) -> tuple[float, float]:
    """A place on the disc's outline."""
    b = DISC[[2, 3, 3, 4]].reshape(2, 2)
    x, y = DISC[:2] + np.linalg.solve(b, [np.cos(angle), np.sin(angle)])
    return float(x), float(y)


# The distance from an ellipse is the linear one, whose slopes are exact on the outline.
CASES = [(corner_kernels.predict, mark_reference.corner, CORNER, place) for place in PLACES] + [
    (circle_kernels.predict, mark_reference.disc, DISC, on_outline(angle)) for angle in (0.3, 2, 4)
]


@pytest.mark.parametrize(("kernel", "reference", "parameters", "place"), CASES)
def test_a_mark_has_the_grey_values_and_slopes_of_its_equation(
    kernel, reference, parameters, place
):
    slopes = np.empty(len(parameters))
    assert kernel(*place, parameters, slopes) == pytest.approx(reference(*place, parameters))
    steps = 1e-6 * np.eye(len(parameters))
    told = [
        (reference(*place, parameters + step) - reference(*place, parameters - step)) / 2e-6
        for step in steps
    ]
    np.testing.assert_allclose(slopes, told, atol=1e-4)


@pytest.mark.kernel
@pytest.mark.parametrize("place", PLACES)
def test_a_disc_has_the_grey_values_of_its_equation_everywhere(place):
    found = circle_kernels.predict(*place, DISC, np.empty(len(DISC)))
    assert found == pytest.approx(mark_reference.disc(*place, DISC))


def test_a_step_has_its_slope():
    high, low = (compute_edge(0.4 + h, 0.9)[0] for h in (1e-6, -1e-6))
    assert compute_edge(0.4, 0.9)[1] == pytest.approx((high - low) / 2e-6)


@pytest.mark.kernel
def test_a_step_solves_its_normal_equations():
    rng = np.random.default_rng(1)
    slopes = rng.normal(size=(40, 9)) * np.logspace(-3, 3, 9)
    normal, right = slopes.T @ slopes, rng.normal(size=9)
    expected = np.linalg.solve(normal, right)
    # Only the lower half is given.
    factor, step = np.tril(normal), right.copy()
    mark_kernels.factorise(factor)
    mark_kernels.solve_factorised(factor, step)
    np.testing.assert_allclose(step, expected, rtol=1e-9)


@pytest.mark.kernel
def test_equations_that_fix_nothing_give_no_step():
    factor, step = np.diag([1.0, -1.0]), np.ones(2)
    mark_kernels.factorise(factor)
    mark_kernels.solve_factorised(factor, step)
    assert np.isnan(step).any()


@pytest.mark.kernel
def test_the_first_step_leaves_the_shape():
    rng = np.random.default_rng(2)
    slopes = rng.normal(size=(40, 9))
    normal, right = slopes.T @ slopes, rng.normal(size=9)
    step = right.copy()
    mark_kernels.solve_step(np.tril(normal), step, 5, True)
    assert (step[:5] == 0.0).all()
    np.testing.assert_allclose(step[5:], np.linalg.solve(normal[5:, 5:], right[5:]), rtol=1e-6)


def test_a_disc_begins_as_its_linear_map_has_it():
    px_from_disc, p = np.array([[9.0, 2.0], [-1.0, 6.0]]), np.zeros(10)
    larger_px = circle_kernels.start_shape(px_from_disc, p)
    shape = np.linalg.inv(sqrtm(px_from_disc @ px_from_disc.T).real)
    np.testing.assert_allclose(p[2:5], shape[[0, 0, 1], [0, 1, 1]])
    assert larger_px == pytest.approx(np.linalg.svd(px_from_disc)[1].max())


def test_the_centre_of_a_disc_is_where_the_camera_sees_it():
    camera = Camera(np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]]), np.empty(0), 640, 480)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [0.0, 0.8, 0.6]])
    pose = np.column_stack([turn[:, :2], [3.0, -4.0, 90.0]])
    homography = camera.matrix @ pose
    to_board = np.linalg.inv(homography)
    conic = to_board.T @ np.diag([1.0, 1.0, -(7.0**2)]) @ to_board
    # Ellipse about its own centre, as the fit finds it.
    middle = -np.linalg.solve(conic[:2, :2], conic[:2, 2])
    level = conic[2, 2] + conic[:2, 2] @ middle
    shape = sqrtm(conic[:2, :2] / -level).real
    p = np.array([*middle, shape[0, 0], shape[0, 1], shape[1, 1]])
    seen = homography @ (0.0, 0.0, 1.0)
    found = circle_kernels.find_pole(p, to_board.T @ (0.0, 0.0, 1.0))
    np.testing.assert_allclose(found, seen[:2] / seen[2], atol=1e-6)
    assert np.linalg.norm(middle - seen[:2] / seen[2]) > 0.5
