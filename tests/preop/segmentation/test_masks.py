import numpy as np
import pytest
from scipy import ndimage

from navapp.preop.segmentation.masks import (
    close_gaps,
    compute_depth_mm,
    find_bounds,
    label_components,
    select_largest,
)

SPACING_MM = np.array([0.5, 0.7, 1.2])
HALF_MM = np.full(3, 0.5)


def blobs():
    noise = np.random.default_rng(0).normal(size=(20, 30, 40))
    return ndimage.gaussian_filter(noise, (2, 3, 4)) > 0.0


def test_depth_is_the_distance_to_the_rim_in_mm():
    mask = blobs()
    rim = mask & ndimage.binary_dilation(~mask, np.ones((3, 3, 3)))
    inner = ndimage.distance_transform_edt(~rim, sampling=SPACING_MM[::-1])
    outer = ndimage.distance_transform_edt(~mask, sampling=SPACING_MM[::-1])
    depth = compute_depth_mm(mask, SPACING_MM)
    np.testing.assert_allclose(depth, np.where(mask, inner, -outer), atol=1e-4)
    assert depth.dtype == np.float32


def test_the_volumes_end_is_no_rim():
    mask = np.ones((5, 9, 9), dtype=bool)
    mask[:, :2] = False
    np.testing.assert_allclose(compute_depth_mm(mask, HALF_MM)[0, 2:, 0], 0.5 * np.arange(7))


def test_components_are_ordered_by_size_and_the_small_left_out():
    mask = np.zeros((6, 20, 20), dtype=bool)
    mask[1:3, 1:3, 1:3] = True
    mask[1:5, 10:14, 1:5] = True
    mask[1:4, 1:4, 10:13] = True
    voxel_mm3 = float(SPACING_MM.prod())
    parts = label_components(mask, SPACING_MM, 0.0)
    assert [int((parts == n).sum()) for n in range(4)] == [2400 - 64 - 27 - 8, 64, 27, 8]
    for least, n_left in ((8.0, 3), (8.1, 2), (27.1, 1), (64.1, 0)):
        assert label_components(mask, SPACING_MM, least * voxel_mm3).max() == n_left
    assert (select_largest(mask, SPACING_MM) == (parts == 1)).all()


def test_components_hang_together_by_faces_alone():
    mask = np.zeros((4, 4, 4), dtype=bool)
    mask[:2, :2, :2] = mask[2:, 2:, 2:] = True
    assert label_components(mask, HALF_MM, 0.0).max() == 2


@pytest.mark.parametrize(("gap", "is_shut"), [(3, True), (5, True), (7, False), (10, False)])
def test_a_gap_of_twice_the_radius_is_closed_and_no_wider_one(gap, is_shut):
    mask = np.zeros((24, 24, 30), dtype=bool)
    mask[4:20, 4:20, 4:10] = mask[4:20, 4:20, 10 + gap : 26] = True
    shut = close_gaps(mask, HALF_MM, 1.5)
    assert shut[12, 12, 4:26].all() == is_shut
    assert shut[mask].all()
    assert not shut[:4].any()
    assert not shut[..., :4].any()


def test_holes_are_filled():
    mask = np.zeros((30, 30, 30), dtype=bool)
    mask[3:27, 3:27, 3:27] = True
    mask[8:22, 8:22, 8:22] = False
    shut = close_gaps(mask, HALF_MM, 1.0)
    assert shut[3:27, 3:27, 3:27].all()
    assert shut.sum() == 24**3


def test_what_is_outside_at_the_volumes_end_stays_outside():
    mask = np.zeros((20, 30, 30), dtype=bool)
    mask[:, 5:25, 5:10] = mask[:, 5:25, 20:25] = True
    assert (close_gaps(mask, HALF_MM, 1.5) == mask).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("end", [0, -1])
def test_the_hollow_of_a_shaft_that_the_volume_cuts_is_filled(axis, end):
    shaft = np.zeros((20, 30, 30), dtype=bool)
    shaft[5:, 5:25, 5:25] = True
    shaft[9:, 9:21, 9:21] = False
    shaft = np.moveaxis(shaft[::-1] if end == 0 else shaft, 0, axis)
    shut = close_gaps(shaft, HALF_MM, 1.0)
    assert shut.sum() == 15 * 20 * 20


def test_a_groove_that_the_volume_cuts_stays_open():
    mask = np.zeros((20, 30, 30), dtype=bool)
    mask[5:, 5:25, 5:25] = True
    mask[5:, 12:18, 12:] = False
    assert (close_gaps(mask, HALF_MM, 1.0) == mask).all()


def test_bounds_hold_what_is_set_and_stop_at_the_volume():
    mask = np.zeros((10, 12, 14), dtype=bool)
    mask[2, 5, 7] = mask[4, 6, 11] = True
    assert find_bounds(mask, np.zeros(3, dtype=np.intp)) == (slice(2, 5), slice(5, 7), slice(7, 12))
    assert find_bounds(mask, np.array([3, 1, 5])) == (slice(0, 8), slice(4, 8), slice(2, 14))
