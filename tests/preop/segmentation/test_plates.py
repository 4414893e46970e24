import numpy as np
import pytest
from scipy.special import ndtr

from navapp.geometry.transform import rotation_from_vector
from navapp.preop.segmentation.plates import find_plates
from tests.preop.ct_phantoms import CORTEX_HU, OBLIQUE, SOFT_HU, lattice, points_of

SIZE = (30, 28, 30)
THICK_MM, BLUR_MM = 1.2, 0.5
# Of the plate, its blur, and the Gaussian that looks at it.
SEEN_MM = float(np.hypot(BLUR_MM, 0.8))


def bend(x):
    """HU per mm2: the second derivative of the blurred plate as it is seen."""

    def slope_of_edge(at):
        y = (x - at) / SEEN_MM
        return -y * np.exp(-0.5 * y**2) / (SEEN_MM**2 * np.sqrt(2 * np.pi))

    edges = slope_of_edge(-0.5 * THICK_MM) - slope_of_edge(0.5 * THICK_MM)
    return (CORTEX_HU - SOFT_HU) * edges


@pytest.mark.parametrize("axes", [np.eye(3), OBLIQUE, np.diag([1.0, -1.0, 1.0])])
@pytest.mark.parametrize("spacing_mm", [(0.5, 0.5, 0.5), (0.5, 0.6, 0.9)])
@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (1.0, 0.0, 0.0)])
def test_a_plate_is_a_ridge_with_valleys_at_its_feet(axes, spacing_mm, normal):
    x = points_of(SIZE, lattice(SIZE, spacing_mm, axes)) @ np.array(normal)
    share = ndtr((x + 0.5 * THICK_MM) / BLUR_MM) - ndtr((x - 0.5 * THICK_MM) / BLUR_MM)
    hu = (SOFT_HU + (CORTEX_HU - SOFT_HU) * share).astype(np.float32)
    plates = find_plates(hu, np.array(spacing_mm), np.ones(hu.shape, dtype=bool))
    inner = (slice(6, -6),) * 3
    expected = bend(x[inner])
    assert expected.min() < -380.0
    assert expected.max() > 150.0
    # A lattice as coarse as the plate is thin sees it a little too wide.
    np.testing.assert_allclose(plates.ridge[inner], np.minimum(expected, 0.0), atol=40.0)
    np.testing.assert_allclose(plates.valley[inner], np.maximum(expected, 0.0), atol=40.0)


def test_nothing_is_said_outside_the_solids():
    hu = np.random.default_rng(0).normal(0.0, 200.0, (12, 12, 12)).astype(np.float32)
    solid = np.zeros(hu.shape, dtype=bool)
    solid[4:8, 4:8, 4:8] = True
    plates = find_plates(hu, np.ones(3), solid)
    assert not plates.ridge[~solid].any()
    assert not plates.valley[~solid].any()
    assert (plates.ridge[solid] < plates.valley[solid]).all()


def test_a_turned_lattice_sees_the_same():
    turned = rotation_from_vector([0.0, 0.0, np.pi / 2])
    spacing = np.array([0.6, 0.6, 0.8])
    ridges = []
    for axes in (np.eye(3), turned):
        points = points_of((21, 21, 21), lattice((21, 21, 21), spacing, axes))
        r = np.hypot(points[..., 0], 0.5 * points[..., 2])
        hu = (1000.0 * np.exp(-0.5 * (r / 2.0) ** 2)).astype(np.float32)
        ridges.append(find_plates(hu, spacing, np.ones(hu.shape, dtype=bool)).ridge)
    np.testing.assert_allclose(ridges[0], ridges[1].transpose(0, 2, 1)[:, ::-1], atol=0.1)
