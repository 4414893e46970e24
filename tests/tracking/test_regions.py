import numpy as np

from navapp.tracking.regions import large_regions


def test_only_regions_of_enough_pixels_are_left() -> None:
    mask = np.zeros((12, 12), dtype=bool)
    mask[1:3, 1:3] = True
    mask[5:8, 5:8] = True
    expected = np.zeros_like(mask)
    expected[5:8, 5:8] = True
    np.testing.assert_array_equal(large_regions(mask, 9), expected)
    np.testing.assert_array_equal(large_regions(mask, 4), mask)
    assert not large_regions(mask, 10).any()
    assert not large_regions(~mask & False, 1).any()


def test_corners_connect_with_eight_neighbours_only() -> None:
    mask = np.eye(4, dtype=bool)
    np.testing.assert_array_equal(large_regions(mask, 4), mask)
    assert not large_regions(mask, 4, connectivity=4).any()
