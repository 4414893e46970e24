from collections.abc import Callable

import numpy as np
import pytest

from navapp.geometry.regions import large_regions, large_smooth_regions, mark_large


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


@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize("share", [0.02, 0.4, 0.6, 0.99])
def test_the_kernels_agree_with_a_flood(share: float, connectivity: int) -> None:
    rng = np.random.default_rng(int(100 * share))
    # More runs than fit at first, and rows and columns that are not alike.
    mask = rng.random((83, 211)) < share
    expected = flooded(mask, 7, connectivity)
    np.testing.assert_array_equal(large_regions(mask, 7, connectivity), expected)
    values = np.where(mask, np.uint8(6), np.uint8(1))
    found = np.zeros(mask.shape, dtype=bool)
    assert mark_large(values, 2, 7, found, connectivity) == expected.sum()
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.95])
@pytest.mark.parametrize("step", [0.4, 1.0])
def test_smooth_regions_agree_with_a_flood(share: float, step: float) -> None:
    rng = np.random.default_rng(int(100 * share))
    values = rng.integers(0, 4, (83, 211)).astype(np.float32)
    values[30:60, 50:150] = 0.3 * np.arange(100)
    values[rng.random(values.shape) < share] = np.nan
    known = np.isfinite(values)
    expected = flooded(known, 7, 4, lambda a, b: abs(values[a] - values[b]) <= step)
    np.testing.assert_array_equal(large_smooth_regions(values, 7, step), expected)


def anything(a: tuple[int, int], b: tuple[int, int]) -> bool:
    return True


def flooded(
    mask: np.ndarray,
    least: int,
    connectivity: int,
    are_connected: Callable[[tuple[int, int], tuple[int, int]], bool] = anything,
) -> np.ndarray:
    """Region by region, pixel by pixel."""
    steps = [(0, 1), (1, 0), (0, -1), (-1, 0)]
    steps += [(1, 1), (1, -1), (-1, 1), (-1, -1)] if connectivity == 8 else []
    left, large = mask.copy(), np.zeros_like(mask)
    for place in np.argwhere(mask):
        region, rim = [], [tuple(place)] if left[tuple(place)] else []
        left[tuple(place)] = False
        while rim:
            y, x = rim.pop()
            region.append((y, x))
            for near in ((y + dy, x + dx) for dy, dx in steps):
                is_inside = 0 <= near[0] < mask.shape[0] and 0 <= near[1] < mask.shape[1]
                if is_inside and left[near] and are_connected(near, (y, x)):
                    left[near] = False
                    rim.append(near)
        if len(region) >= least:
            large[tuple(np.array(region).T)] = True
    return large
