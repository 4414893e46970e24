import numpy as np
import pytest

from navapp.preop.segmentation.masks import compute_depth_mm, label_components
from navapp.preop.segmentation.solids import find_solids
from navapp.preop.volume.hounsfield import PADDING_HU
from tests.many import few_of
from tests.preop.ct_phantoms import (
    AIR_HU,
    MARROW_HU,
    SOFT_HU,
    box,
    cylinder,
    hollow_box,
    hollow_cylinder,
    lattice,
    points_of,
)

SIZE, SPACING_MM = (84, 80, 46), np.array([0.6, 0.6, 0.8])
POINTS = points_of(SIZE, lattice(SIZE, SPACING_MM))
LOWER_MM, UPPER_MM = np.array([-12.0, -11.0, -13.0]), np.array([12.0, 11.0, 13.0])


def noisy(hu):
    return (hu + np.random.default_rng(3).normal(0.0, 20.0, hu.shape)).astype(np.float32)


def within(lower_mm, upper_mm, margin_mm):
    """Voxels deeper than a margin in a box."""
    return ((lower_mm + margin_mm < POINTS) & (upper_mm - margin_mm > POINTS)).all(axis=-1)


def bone(cortex_mm=2.0):
    return SOFT_HU + hollow_box(POINTS, LOWER_MM, UPPER_MM, cortex_mm, inside_hu=MARROW_HU)


def test_a_hollow_bone_is_one_solid_with_its_marrow():
    solid = find_solids(noisy(bone()), SPACING_MM, 200.0)
    assert solid[within(LOWER_MM, UPPER_MM, 0.6)].all()
    assert not solid[~within(LOWER_MM, UPPER_MM, -1.2)].any()
    assert label_components(solid, SPACING_MM, 0.0).max() == 1


@pytest.mark.parametrize("threshold_hu", few_of([150.0, 350.0]))
def test_a_shaft_that_the_volume_cuts_keeps_its_marrow(threshold_hu):
    hu = SOFT_HU + hollow_cylinder(POINTS, 12.0, 2.0, inside_hu=MARROW_HU)
    solid = find_solids(noisy(hu), SPACING_MM, threshold_hu)
    r = np.hypot(POINTS[..., 0], POINTS[..., 1])
    assert solid[r < 11.4].all()
    assert not solid[r > 13.2].any()


def test_a_shaft_that_ends_in_padding_keeps_its_marrow():
    hu = noisy(SOFT_HU + hollow_cylinder(POINTS, 12.0, 2.0, inside_hu=MARROW_HU))
    is_padding = POINTS @ [0.3, 0.2, 1.0] > 6.0
    hu[is_padding] = PADDING_HU
    solid = find_solids(hu, SPACING_MM, 200.0)
    r = np.hypot(POINTS[..., 0], POINTS[..., 1])
    assert solid[(r < 11.4) & ~is_padding].all()
    # A sheet of voxels may stay where flesh ends obliquely, too thin for any core.
    assert compute_depth_mm(solid & ((r > 13.2) | is_padding), SPACING_MM).max() < 1.0


def test_a_table_in_air_and_debris_are_left_out():
    flesh = box(POINTS, (-17.0, -16.0, -50.0), (23.0, 14.0, 50.0))
    table = box(POINTS, (-50.0, 15.5, -50.0), (50.0, 17.5, 50.0))
    crumb_mm = np.array([18.0, -5.0, 0.0])
    crumb = box(POINTS, crumb_mm - 2.0, crumb_mm + 2.0)
    hu = bone() - SOFT_HU + AIR_HU + (SOFT_HU - AIR_HU) * flesh + 1300.0 * table + 400.0 * crumb
    assert (hu[:, 67, 42] > 200.0).all()
    solid = find_solids(noisy(hu), SPACING_MM, 200.0)
    assert solid[within(LOWER_MM, UPPER_MM, 0.6)].all()
    assert not solid[~within(LOWER_MM, UPPER_MM, -1.2)].any()


@pytest.mark.parametrize(("hole_mm", "is_open"), [(1.8, False), (5.0, True)])
def test_tissue_comes_in_through_a_hole_and_not_through_a_pore(hole_mm, is_open):
    channel = cylinder(POINTS, 0.5 * hole_mm, 0.1) * (POINTS[..., 2] > 8.0)
    hu = bone(2.5)
    hu += channel * (MARROW_HU - hu)
    solid = find_solids(noisy(hu), SPACING_MM, 200.0)
    assert solid[within(LOWER_MM + 4.0, UPPER_MM - 4.0, 0.0)].any() != is_open


def test_tissue_does_not_come_in_through_a_crack():
    """Long, and narrower than two millimetres: a fracture, a thin spot of the cortex."""
    hu = bone(2.5)
    hu += box(POINTS, (-6.0, -0.6, 8.0), (6.0, 1.2, 14.0), 0.1) * (MARROW_HU - hu)
    solid = find_solids(noisy(hu), SPACING_MM, 200.0)
    assert solid[within(LOWER_MM + 4.0, UPPER_MM - 4.0, 0.0)].all()


def test_nothing_dense_is_no_solid():
    assert not find_solids(noisy(np.full(SIZE[::-1], SOFT_HU)), SPACING_MM, 200.0).any()


def test_a_volume_of_nothing_but_bone_has_no_outside():
    """A region laid inside a bone."""
    solid = find_solids(noisy(np.full(SIZE[::-1], 900.0)), SPACING_MM, 200.0)
    assert solid.all()
