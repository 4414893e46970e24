"""A dense map around a surface: what is matched, what is a guess, what stands before the band."""

from dataclasses import replace
from functools import lru_cache, partial
from math import ceil, floor

import cv2
import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedGeometry, RectifiedPair
from navapp.stereo import (
    NearerSearch,
    fill_surroundings,
    match_coarsely,
    match_nearer,
    surroundings,
)
from navapp.stereo.coarse import CoarseMap
from navapp.values import DisparityMap, Origin, Surroundings
from tests.stereo.pairs import shifted_pair
from tests.stereo.test_chains import (
    EVERY_RESOLUTION,
    FULL,
    HALF,
    HEIGHT,
    INSIDE,
    IS_HIDDEN,
    IS_NEAR,
    TRUTH,
    WALL,
    WIDTH,
    X,
    edge_distance_px,
    part,
    scene,
    swapped,
)

# A rectangle so near stands before bands that hold the wall alone, at either resolution.
HAND_PX = 64
WALL_ALONE = pytest.mark.parametrize("band_px", [(20.0, 46.0), (10.0, 48.0)])


@lru_cache
def hand_before_wall(box: Box = INSIDE) -> RectifiedPair:
    wall = shifted_pair(WALL, box, 0)
    hand = shifted_pair(np.full(X.shape, float(HAND_PX)), box, 1)
    left = np.where(IS_NEAR, hand.left, wall.left)
    right = np.where(np.roll(IS_NEAR, -HAND_PX, axis=1), hand.right, wall.right)
    return replace(wall, left=left, right=right)


def fill(
    pair: RectifiedPair, band_px: tuple[float, float], nearest_px: float = 0.0
) -> DisparityMap:
    rectify = {n: partial(reduced, pair, n) for n in NearerSearch.REDUCTIONS}
    nearer = NearerSearch(nearest_px, rectify)
    return whole(fill_surroundings(match_nearer(match_coarsely(pair, band_px), nearer)))


def reduced(
    pair: RectifiedPair, reduction: int, box: Box, band_px: tuple[float, float]
) -> RectifiedPair:
    """What is rectified at 1/reduction of the resolution for a box and a band: else all is 0."""
    geometry = pair.geometry.reduced(reduction)
    inside = box.clip(geometry.width, geometry.height)
    around = inside.grow(8)
    first = max(around.x - ceil(band_px[1]), 0)
    reached = slice(first, max(around.x + around.width - floor(band_px[0]), first))
    rows, columns = around.clip(geometry.width, geometry.height).slices
    left, right = np.zeros((2, geometry.height, geometry.width), np.uint8)
    left[rows, columns] = reduce(pair.left, geometry)[rows, columns]
    right[rows, reached] = reduce(pair.right, geometry)[rows, reached]
    return RectifiedPair(left, right, geometry, inside)


def reduce(picture: np.ndarray, geometry: RectifiedGeometry) -> np.ndarray:
    """Means of the blocks that fill the reduced picture."""
    reduction = picture.shape[1] // geometry.width
    even = picture[: reduction * geometry.height, : reduction * geometry.width]
    size = geometry.width, geometry.height
    return np.asarray(cv2.resize(even, size, interpolation=cv2.INTER_AREA))


def whole(filled: Surroundings) -> DisparityMap:
    disparity_px, origin = filled.whole
    return DisparityMap(disparity_px, disparity_px, origin, filled.box.x, filled.box.y)


def is_clear(distance_px: float = 8.0) -> np.ndarray:
    """(h, w) of the box away from edges, where the wall is in both pictures."""
    return part((edge_distance_px() > distance_px) & (X - WALL > 12.0), INSIDE)


@EVERY_RESOLUTION
def test_matches_stay_and_gaps_become_guesses_with_their_class(
    band_px: tuple[float, float],
) -> None:
    found, clear = fill(scene(INSIDE), band_px), is_clear()
    assert found.box == INSIDE
    error = np.abs(found.disparity_px - part(TRUTH, INSIDE))
    assert np.nanpercentile(error[clear & ~part(IS_HIDDEN, INSIDE)], 98) < 1.0
    hidden = is_clear(4.0) & part(IS_HIDDEN, INSIDE)
    assert (found.origin[hidden] == Origin.FILLED_INTERIOR).mean() > 0.9
    # From the left, as the wall goes on.
    assert np.percentile(error[hidden], 90) < 2.0
    assert (found.origin[clear & ~hidden] == Origin.MATCHED).mean() > 0.95
    assert np.array_equal(np.isnan(found.disparity_px), found.origin == Origin.UNKNOWN)


@EVERY_RESOLUTION
def test_matches_that_hang_over_the_edge_are_withdrawn(band_px: tuple[float, float]) -> None:
    coarse = match_coarsely(scene(INSIDE), band_px)
    filled = fill_surroundings(coarse)
    before = coarse.matched.found.left.is_matched
    assert (filled.origin[before] == Origin.FILLED_INTERIOR).any()


@WALL_ALONE
def test_what_stands_before_the_band_is_found(band_px: tuple[float, float]) -> None:
    near = part(IS_NEAR, INSIDE) & is_clear(12.0)
    without, found = (fill(hand_before_wall(), band_px, nearest) for nearest in (0.0, 80.0))
    assert not (np.abs(without.disparity_px[near] - HAND_PX) < 2.0).any()
    assert (np.abs(found.disparity_px[near] - HAND_PX) < 2.0).mean() > 0.97
    assert (found.origin[near] == Origin.MATCHED).mean() > 0.9
    # Left of it the wall is hidden, and above and below it the wall is what it was.
    wall = is_clear(24.0) & ~part(IS_NEAR, INSIDE) & (part(X, INSIDE) > 260)
    assert np.nanpercentile(np.abs(found.disparity_px - part(WALL, INSIDE))[wall], 98) < 1.0


@WALL_ALONE
def test_without_a_wide_gap_nothing_nearer_is_looked_for(
    band_px: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def spy(matched, gap, nearer):
        asked.append(matched)
        return matched.found

    monkeypatch.setattr(surroundings, "_add_nearer", spy)
    for box, n_asked in ((Box(344, 9, 110, 220), 0), (INSIDE, 1)):
        fill(replace(hand_before_wall(), box=box), band_px, 80.0)
        assert len(asked) == n_asked


@pytest.mark.parametrize("band_px", [FULL, HALF])
def test_pictures_that_disagree_tell_nothing(band_px: tuple[float, float]) -> None:
    coarse = match_coarsely(swapped(scene(INSIDE)), band_px)
    assert coarse.matched is None
    found = whole(fill_surroundings(coarse))
    assert found.box == INSIDE
    assert np.isnan(found.disparity_px).all()
    assert (found.origin == Origin.UNKNOWN).all()


@pytest.mark.parametrize(("band_px", "step"), [(FULL, 1), (HALF, 2)])
def test_the_picture_comes_along_in_the_resolution_of_the_map(
    band_px: tuple[float, float], step: int
) -> None:
    pair = scene(INSIDE)
    found = fill_surroundings(match_coarsely(pair, band_px))
    assert found.is_half is (step == 2)
    assert found.picture.shape == found.origin.shape
    left = pair.left[INSIDE.slices].astype(float)
    height, width = (step * (n // step) for n in left.shape)
    blocks = left[:height, :width].reshape(height // step, step, width // step, step)
    means = blocks.mean(axis=(1, 3))
    own = found.picture[: means.shape[0], : means.shape[1]].astype(float)
    assert np.corrcoef(own.ravel(), means.ravel())[0, 1] > (0.999 if step == 1 else 0.6)


@pytest.mark.parametrize(("rows", "columns"), [(1, 0), (0, 1), (1, 1)])
def test_pictures_of_odd_size_are_filled_to_their_rim(rows: int, columns: int) -> None:
    whole = scene(INSIDE)
    height, width = HEIGHT - rows, WIDTH - columns
    geometry = replace(whole.geometry, width=width, height=height)
    cut = (picture[:height, :width].copy() for picture in (whole.left, whole.right))
    pair = RectifiedPair(*cut, geometry, Box(61, 9, width - 61, height - 9))
    found = fill(pair, HALF)
    assert found.box == pair.box
    assert (found.origin == Origin.MATCHED).mean() > 0.8


def test_a_coarse_map_tells_of_a_box_inside_it() -> None:
    values = np.arange(48, dtype=np.float32).reshape(6, 8)
    coarse = CoarseMap(values, Box(10, 20, 8, 6))
    np.testing.assert_array_equal(coarse.over(Box(11, 22, 3, 4)), values[2:6, 1:4])
    np.testing.assert_array_equal(coarse.over(coarse.box), values)
    for beyond in (Box(9, 22, 3, 4), Box(11, 19, 3, 4), Box(16, 22, 3, 4), Box(11, 23, 3, 4)):
        assert coarse.over(beyond) is None
