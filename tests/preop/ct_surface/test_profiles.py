import numpy as np
import pytest

from navapp.preop.ct_surface.profiles import make_cubic_interpolation, sample_along
from tests.preop.ct_phantoms import OBLIQUE, ct_of, lattice, leaning_axes, points_of

SIZE, SPACING_MM = (22, 20, 18), (0.6, 0.7, 0.9)
LATTICES = [np.eye(3), OBLIQUE, leaning_axes(), np.diag([-1.0, 1.0, 1.0])]


def smooth(points):
    return 300.0 * np.sin(points[..., 0] / 2.5) + 200.0 * np.cos(points @ [0.2, 0.3, -0.25])


@pytest.mark.parametrize("axes", LATTICES)
def test_density_is_where_the_patient_is(axes):
    matrix = lattice(SIZE, SPACING_MM, axes, (30.0, -12.0, 400.0))
    density = make_cubic_interpolation(ct_of(smooth(points_of(SIZE, matrix)), matrix))
    points = np.array([30.0, -12.0, 400.0]) + np.random.default_rng(0).uniform(-3, 3, (5, 8, 3))
    np.testing.assert_allclose(density(points), smooth(points), atol=3.0)


def test_beyond_the_border_it_goes_on():
    ct = ct_of(np.full(SIZE[::-1], 70.0), lattice(SIZE, SPACING_MM))
    found = make_cubic_interpolation(ct)(np.array([[100.0, 0.0, 0.0], [0.0, 0.0, -90.0]]))
    np.testing.assert_allclose(found, 70.0, atol=0.1)


def test_profiles_run_along_the_normals():
    rng = np.random.default_rng(1)
    points, normals = rng.normal(size=(20_000, 3)), rng.normal(size=(20_000, 3))
    positions = np.array([-2.0, 0.0, 1.5])
    found = sample_along(points, normals, positions, lambda at: at @ [1.0, 10.0, 100.0])
    expected = points @ [1.0, 10.0, 100.0]
    slope = normals @ [1.0, 10.0, 100.0]
    np.testing.assert_allclose(found, expected[:, None] + positions * slope[:, None])
    assert sample_along(points[:0], normals[:0], positions, smooth).shape == (0, 3)
