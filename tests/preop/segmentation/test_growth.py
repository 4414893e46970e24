"""Cores and the bones grown from them, where one component is several bones."""

import itertools

import numpy as np
import pytest

from navapp.preop.segmentation.cores import find_cores
from navapp.preop.segmentation.growth import _put_bone, _up_to_plates, grow
from navapp.preop.segmentation.masks import label_components
from navapp.preop.segmentation.plates import find_plates
from navapp.preop.segmentation.solids import find_solids
from tests.many import few_of
from tests.preop.ct_phantoms import (
    MARROW_HU,
    SOFT_HU,
    SPONGY_HU,
    cylinder,
    hollow_ball,
    hollow_box,
    hollow_cylinder,
    lattice,
    points_of,
)

SPACING_MM = np.array([0.55, 0.55, 0.85])
# Voxels whose centre is this deep in a bone are its own; the others are of the rim.
RIM_MM = 0.4


def in_box(points, lower_mm, upper_mm):
    """Depth of points in a box, at most the true one."""
    return np.minimum(points - np.array(lower_mm), np.array(upper_mm) - points).min(axis=-1)


def in_ball(points, centre_mm, radius_mm):
    return radius_mm - np.linalg.norm(points - np.array(centre_mm), axis=-1)


def parted(hu, n_bones, threshold_hu=200.0, seed=0):
    """Bones grown from the first cores that are enough, as an operator's seeds would ask."""
    hu = (hu + np.random.default_rng(seed).normal(0.0, 20.0, hu.shape)).astype(np.float32)
    solid = find_solids(hu, SPACING_MM, threshold_hu)
    plates = find_plates(hu, SPACING_MM, solid)
    for cores in find_cores(plates, solid, SPACING_MM):
        if cores.max() >= n_bones:
            assert cores.max() == n_bones
            return grow(cores, hu, plates, solid, SPACING_MM, threshold_hu)
    raise AssertionError("the bones were not told apart")


def assert_bones_are(bones, depths_mm):
    """Each voxel of a bone is numbered as it, and none outside all."""
    numbers = []
    for depth_mm in depths_mm:
        values, counts = np.unique(bones[depth_mm > RIM_MM], return_counts=True)
        assert list(values) == [values[0]], dict(zip(values, counts, strict=True))
        numbers.append(int(values[0]))
    assert sorted(numbers) == list(range(1, len(depths_mm) + 1))
    outside = np.max(depths_mm, axis=0) < -1.0
    assert not bones[outside].any()


def balls(points, gap_mm):
    middle = 16.0 + 0.5 * gap_mm
    spheres = [((0.0, 0.0, -middle), 16.0), ((0.0, 3.0, middle - 0.25), 16.0)]
    hu = SOFT_HU + sum(hollow_ball(points, *sphere) for sphere in spheres)
    return hu, [in_ball(points, *sphere) for sphere in spheres]


def boxes(points, gap_mm):
    sizes = [((-13, -12, -20), (13, 12, -gap_mm / 2)), ((-12, -12, gap_mm / 2), (14, 12, 19))]
    hu = SOFT_HU + sum(hollow_box(points, *size) for size in sizes)
    return hu, [in_box(points, *size) for size in sizes]


@pytest.mark.parametrize("threshold_hu", few_of([150.0, 200.0, 350.0]))
@pytest.mark.parametrize(
    ("shapes", "size"), [(balls, (68, 74, 88)), (boxes, (60, 54, 58))], ids=["balls", "boxes"]
)
def test_two_bones_a_millimetre_apart_come_apart(shapes, size, threshold_hu):
    hu, depths_mm = shapes(points_of(size, lattice(size, SPACING_MM)), 1.3)
    one = label_components(hu > 200.0, SPACING_MM, 100.0)
    assert one[depths_mm[0] > RIM_MM].max() == one[depths_mm[1] > RIM_MM].max()
    assert_bones_are(parted(hu, 2, threshold_hu), depths_mm)


@pytest.mark.release
def test_a_spur_that_leans_over_the_other_bone_stays_its_own():
    size = (76, 60, 64)
    points = points_of(size, lattice(size, SPACING_MM))
    upper = hollow_box(points, (-13, -12, 0.8), (13, 12, 20))
    # A plate of 2.4 mm, all cortex, grown down over the side of the lower bone.
    spur_mm = ((13.0, -8.0, -9.0), (15.4, 8.0, 8.0))
    spur = hollow_box(points, *spur_mm, 1.2, inside_hu=1200.0)
    lower = hollow_box(points, (-13, -12, -20), (11.6, 12, -0.8))
    bones = parted(SOFT_HU + upper + spur + lower, 2)
    over = in_box(points, *spur_mm)
    above = np.maximum(in_box(points, (-13, -12, 0.8), (13, 12, 20)), over)
    above[(np.abs(points[..., 0] - 13.0) < 1.0) & (over > -1.0)] = -0.5
    below = in_box(points, (-13, -12, -20), (11.6, 12, -0.8))
    assert_bones_are(bones, [above, below])
    # As far down as it goes.
    of_spur = bones[(over > RIM_MM) & (points[..., 2] < -5.0)]
    assert len(of_spur) > 200
    assert len(np.unique(of_spur)) == 1


@pytest.mark.parametrize("n_bones", few_of([3, 4]))
def test_three_and_four_bones_of_one_component(n_bones):
    size = (92, 62, 62)
    points = points_of(size, lattice(size, SPACING_MM))
    edges_mm = [
        ((-22, -13, -22), (4, 13, -0.7)),
        ((-22, -13, 0.7), (4, 13, 21)),
        ((5.4, -12, -21), (22, 12, -1)),
        ((5.4, -11, 1), (22, 11, 20)),
    ][:n_bones]
    hu = SOFT_HU + sum(hollow_box(points, *edges) for edges in edges_mm)
    assert label_components(hu > 200.0, SPACING_MM, 100.0).max() == 1
    assert_bones_are(parted(hu, n_bones), [in_box(points, *edges) for edges in edges_mm])


@pytest.mark.release
def test_a_shaft_that_the_volume_cuts_keeps_its_marrow():
    size = (60, 60, 30)
    points = points_of(size, lattice(size, SPACING_MM))
    hu = SOFT_HU + hollow_cylinder(points, 12.0, inside_hu=MARROW_HU)
    depth = 12.0 - np.hypot(points[..., 0], points[..., 1])
    assert_bones_are(parted(hu, 1), [depth])


def test_the_first_slice_is_no_neighbour_of_the_last():
    """Two bones, one cut by the top of the volume and one by its end below."""
    size = (60, 54, 44)
    points = points_of(size, lattice(size, SPACING_MM))
    upper = hollow_box(points, (-13, -12, 0.8), (13, 12, 60))
    hu = (SOFT_HU + upper + hollow_box(points, (-9, -8, -60), (9, 8, -0.8))).astype(np.float32)
    solid = find_solids(hu, SPACING_MM, 200.0)
    plates = find_plates(hu, SPACING_MM, solid)
    cores = next(cores for cores in find_cores(plates, solid, SPACING_MM) if cores.max() == 2)
    grown = _up_to_plates(cores, plates, solid, SPACING_MM)
    np.testing.assert_array_equal(grown[0], grown[3])
    np.testing.assert_array_equal(grown[-1], grown[-4])


@pytest.mark.release
def test_a_vessel_through_both_plates_leads_no_bone_into_the_other():
    size = (60, 54, 58)
    points = points_of(size, lattice(size, SPACING_MM))
    hu, depths_mm = boxes(points, 1.3)
    channel = cylinder(points, 1.5, 0.3) * (np.abs(points[..., 2]) < 3.0)
    bones = parted(hu + channel * (SPONGY_HU - hu), 2)
    assert_bones_are(bones, depths_mm)


def tongue():
    """A bone that holds a tongue of another on both sides, and a pit in its outside."""
    basins = np.full((30, 30, 30), 255, dtype=np.uint8)
    basins[5:25, 5:25, 5:25] = 1
    basins[10:25, 13:17, 5:25] = 2
    is_bony = np.ones(basins.shape, dtype=bool)
    is_bony[14:16, 5:9, 14:16] = False
    return basins, is_bony


def test_pores_are_closed_and_neighbours_are_not():
    basins, is_bony = tongue()
    bones = np.zeros(basins.shape, dtype=np.uint8)
    for bone in (2, 1):
        _put_bone(bones, bone, basins, is_bony, np.full(3, 0.55))
    expected = np.where(basins == 255, 0, basins)
    # The mouth of the pit is as wide as a ball sinks in.
    np.testing.assert_array_equal(bones[:, 6:], expected[:, 6:])
    assert (bones[:, 5] != expected[:, 5]).sum() <= 4


def test_cores_become_finer():
    size = (60, 54, 58)
    hu, _ = boxes(points_of(size, lattice(size, SPACING_MM)), 1.3)
    hu = hu.astype(np.float32)
    solid = find_solids(hu, SPACING_MM, 200.0)
    found = list(find_cores(find_plates(hu, SPACING_MM, solid), solid, SPACING_MM))
    inside = [cores > 0 for cores in found]
    assert len(inside) > 1
    assert inside[-1].sum() < inside[0].sum()
    for coarser, finer in itertools.pairwise(inside):
        assert not coarser[~solid].any()
        assert not (finer & ~coarser).any()
