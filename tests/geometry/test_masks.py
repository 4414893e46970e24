"""Pictures under masks, and connected regions."""

from collections.abc import Callable

import numpy as np
import pytest

from navapp.geometry.masks import (
    grow,
    large_regions,
    large_smooth_regions,
    mark_large,
    shrink,
    where,
)

pytestmark = pytest.mark.kernel

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("shape", [(13, 17), (1, 1), (0, 5), (5, 0)])
def test_it_answers_as_numpy(shape: tuple[int, int], dtype: type) -> None:
    mask, values, other = RNG.random(shape) < 0.4, *RNG.integers(0, 200, (2, *shape))
    values, other = values.astype(dtype), other.astype(dtype)
    for elsewhere in (other, dtype(7)):
        found = where(mask, values, elsewhere)
        assert found.dtype == dtype
        np.testing.assert_array_equal(found, np.where(mask, values, elsewhere))


def test_parts_of_pictures_and_unknown_values_are_copied_as_they_are() -> None:
    picture = RNG.random((20, 30)).astype(np.float32)
    picture[4:9] = np.nan
    part, mask = picture[3:15, 5:22], RNG.random((20, 30))[3:15, 5:22] < 0.5
    before = part.copy()
    found = where(mask, part, np.float32(np.nan))
    np.testing.assert_array_equal(found, np.where(mask, part, np.float32(np.nan)))
    np.testing.assert_array_equal(part, before)


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
    assert mark_large(values, (2,), 7, found, connectivity) == expected.sum()
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


@pytest.mark.parametrize("base", [0.0, 900.0, -300.5])
def test_small_patches_go_and_large_ones_stay(base) -> None:
    disparity = np.full((12, 20), np.nan, dtype=np.float32)
    disparity[1:5, 1:5] = base + 10.0  # 16 pixels
    disparity[7:10, 1:6] = base + 10.0  # 15 pixels
    disparity[1:9, 10:18] = base + 20.0 + 0.9 * np.arange(8)  # slanted, connected
    kept = large_smooth_regions(disparity, 16, 1.0)
    assert kept[1:5, 1:5].all()
    assert not kept[7:10].any(where=np.arange(20) < 8)
    assert kept[1:9, 10:18].all()
    assert kept.sum() == 16 + 64


def test_patches_are_parted_where_the_disparity_jumps() -> None:
    disparity = np.full((4, 8), 5.0, dtype=np.float32)
    disparity[:, 3:] = 6.5
    kept = large_smooth_regions(disparity, 20, 1.0)
    assert not kept[:, :3].any()
    assert kept[:, 3:].all()


def test_whole_steps_of_single_precision_connect_and_larger_ones_part() -> None:
    # Across a power of two, the last digits of two neighbours weigh differently.
    whole = (1020.0 + 8.54e-5 + np.arange(8.0)).astype(np.float32)[None]
    assert np.abs(np.diff(whole)).max() > 1.0
    assert large_smooth_regions(whole, 8, 1.0).all()
    assert not large_smooth_regions((1.01 * np.arange(8.0)).astype(np.float32)[None], 2, 1.0).any()


def test_nothing_known_stays_nothing() -> None:
    assert not large_smooth_regions(np.full((3, 3), np.nan, dtype=np.float32), 2, 1.0).any()


def test_a_mask_grows_and_shrinks_in_rows_and_columns_alike() -> None:
    mask = np.zeros((9, 9), dtype=np.bool_)
    mask[4, 4] = True
    grown = grow(mask, 2)
    assert grown.sum() == 25
    assert grown[2:7, 2:7].all()
    np.testing.assert_array_equal(shrink(grown, 2), mask)
    # Beside the picture nothing is of the mask.
    assert shrink(np.ones((9, 9), dtype=np.bool_), 4).sum() == 1
