"""The stereo chains on scenes whose disparity is known."""

import time
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.chains import (
    StereoAnswer,
    match_on_support,
    match_scene,
    match_surface,
)
from navapp.values import Origin
from tests.stereo.pairs import shifted_pair

HEIGHT, WIDTH = 240, 480
Y, X = np.mgrid[:HEIGHT, :WIDTH].astype(float)
WALL = 24.0 + 0.03 * X + 0.02 * Y
NEAR_PX = 44
NEAR = np.full(X.shape, float(NEAR_PX))
IS_NEAR = (X >= 250) & (X < 340) & (Y >= 60) & (Y < 180)
TRUTH = np.where(IS_NEAR, NEAR, WALL)
# Of the wall: what stands behind the near rectangle in the right picture.
IS_HIDDEN = (
    (X < 250) & (Y >= 60) & (Y < 180) & (X - WALL >= 250 - NEAR_PX) & (X - WALL < 340 - NEAR_PX)
)
INSIDE, AT_LEFT_EDGE = Box(61, 9, 400, 220), Box(0, 9, 420, 220)
FAR_RIGHT = Box(181, 9, 280, 220)
# The same boxes with either band: too few cells for half resolution, and enough.
FULL, HALF = (20.0, 50.0), (20.0, 58.0)
EVERY_RESOLUTION = pytest.mark.parametrize("band_px", [FULL, HALF])


@lru_cache
def scene(box: Box) -> RectifiedPair:
    """A near rectangle before a slanted wall; each camera sees what the other does not."""
    wall, near = (shifted_pair(d, box, seed) for seed, d in enumerate((WALL, NEAR)))
    left = np.where(IS_NEAR, near.left, wall.left)
    right = np.where(np.roll(IS_NEAR, -NEAR_PX, axis=1), near.right, wall.right)
    return replace(wall, left=left, right=right)


def swapped(pair: RectifiedPair) -> RectifiedPair:
    return replace(pair, left=pair.right, right=pair.left)


@lru_cache
def surface(box: Box, band_px: tuple[float, float], fills: bool) -> StereoAnswer:
    return match_surface(scene(box), band_px, fills=fills)


def part(values: np.ndarray, box: Box) -> np.ndarray:
    return values[box.y : box.y + box.height, box.x : box.x + box.width]


def edge_distance_px() -> np.ndarray:
    """(H, W) from the outline of the near rectangle and of what it hides."""
    from scipy.ndimage import distance_transform_edt

    label = IS_NEAR + 2 * IS_HIDDEN
    is_outline = np.zeros(label.shape, dtype=bool)
    is_outline[1:] |= label[1:] != label[:-1]
    is_outline[:, 1:] |= label[:, 1:] != label[:, :-1]
    return distance_transform_edt(~is_outline)


@EVERY_RESOLUTION
@pytest.mark.parametrize("box", [INSIDE, AT_LEFT_EDGE])
def test_a_surface_is_measured_to_a_part_of_a_pixel(box: Box, band_px: tuple[float, float]) -> None:
    answer = surface(box, band_px, False)
    assert answer.reasons == ()
    error = answer.disparity.disparity_px - part(TRUTH, box)
    can_be_seen = part((X - WALL > 6.0) & ~IS_HIDDEN, box)
    assert np.isfinite(error[can_be_seen]).mean() > 0.93
    clear = can_be_seen & (part(edge_distance_px(), box) > 16.0) & np.isfinite(error)
    assert np.median(np.abs(error[clear])) < 0.05
    assert np.percentile(np.abs(error[clear]), 99) < 0.2
    assert abs(error[clear].mean()) < 0.01
    assert (answer.disparity.x, answer.disparity.y) == (box.x, box.y)


def test_half_and_full_resolution_agree() -> None:
    full, half = (surface(INSIDE, band, False).disparity.disparity_px for band in (FULL, HALF))
    both = np.isfinite(full) & np.isfinite(half)
    assert both.mean() > 0.9
    assert both.sum() > 0.95 * max(np.isfinite(full).sum(), np.isfinite(half).sum())
    difference = np.abs(full - half)[both & (part(edge_distance_px(), INSIDE) > 16.0)]
    assert np.median(difference) < 0.01
    assert np.percentile(difference, 99) < 0.1


@pytest.mark.parametrize("match", [match_surface, match_scene])
@EVERY_RESOLUTION
@pytest.mark.parametrize("fills", [True, False])
def test_swapped_pictures_give_no_map_and_the_reason(
    match, band_px: tuple[float, float], fills: bool
) -> None:
    answer = match(swapped(scene(INSIDE)), band_px, fills=fills)
    assert len(answer.reasons) == 1
    assert "swapped" in answer.reasons[0]
    for found in (answer.disparity, answer.matched):
        assert found.disparity_px.shape == (INSIDE.height, INSIDE.width)
        assert np.isnan(found.disparity_px).all()
        assert np.isnan(found.sigma_px).all()
        assert (found.origin == Origin.UNKNOWN).all()
        assert (found.x, found.y) == (INSIDE.x, INSIDE.y)


@EVERY_RESOLUTION
def test_without_fill_nothing_but_matches_is_handed_out(band_px: tuple[float, float]) -> None:
    answer = surface(INSIDE, band_px, False)
    found, matched = answer.disparity, surface(INSIDE, band_px, True).matched
    np.testing.assert_array_equal(found.disparity_px, matched.disparity_px)
    np.testing.assert_array_equal(found.origin == Origin.MATCHED, np.isfinite(found.disparity_px))
    assert set(np.unique(found.origin)) == {Origin.UNKNOWN, Origin.MATCHED}
    assert np.isnan(found.disparity_px[part(IS_HIDDEN, INSIDE)]).mean() > 0.7
    np.testing.assert_array_equal(answer.matched.disparity_px, found.disparity_px)


@EVERY_RESOLUTION
def test_the_strip_that_the_right_camera_misses_is_filled_from_its_right(
    band_px: tuple[float, float],
) -> None:
    found = surface(AT_LEFT_EDGE, band_px, True).disparity
    # The first and the last row have no match to be filled from.
    rows = slice(1, -1)
    is_strip = part(X - WALL < 0.0, AT_LEFT_EDGE)[rows]
    origin = found.origin[rows]
    assert (origin[is_strip] == Origin.FILLED_BORDER).all()
    assert (origin[~is_strip] == Origin.FILLED_BORDER).mean() < 0.01
    error = np.abs(found.disparity_px - part(WALL, AT_LEFT_EDGE))[rows][is_strip]
    assert np.median(error) < 0.6
    assert error.max() < 2.0


@EVERY_RESOLUTION
def test_a_box_inside_the_picture_has_no_border_strip(band_px: tuple[float, float]) -> None:
    origin = surface(INSIDE, band_px, True).disparity.origin
    assert not (origin == Origin.FILLED_BORDER).any()


@pytest.mark.parametrize(
    ("box", "band_px"),
    [
        (INSIDE, FULL), (INSIDE, HALF), (AT_LEFT_EDGE, FULL), (AT_LEFT_EDGE, HALF),
        # What of the right picture is matched begins at 0 above, right of it here.
        (FAR_RIGHT, (20.0, 60.0)), (FAR_RIGHT, (20.0, 75.0)),
    ],
)  # fmt: skip
def test_what_the_near_rectangle_hides_is_filled_with_the_wall(
    box: Box, band_px: tuple[float, float]
) -> None:
    answer = surface(box, band_px, True)
    is_interior = answer.disparity.origin == Origin.FILLED_INTERIOR
    is_hidden = part(IS_HIDDEN, box)
    assert is_hidden.sum() > 1000
    assert is_interior[is_hidden].mean() > 0.7
    # Elsewhere only at the rectangle's outline.
    outside = is_interior & ~is_hidden
    assert outside.sum() < 0.25 * is_hidden.sum()
    assert part(edge_distance_px(), box)[outside].max() < 16.0
    error = np.abs(answer.disparity.disparity_px - part(WALL, box))[is_interior & is_hidden]
    # The near rectangle differs by some 12 px.
    assert np.median(error) < 0.5
    assert np.percentile(error, 90) < 1.0


@EVERY_RESOLUTION
def test_matches_keep_their_value_through_the_fill(band_px: tuple[float, float]) -> None:
    answer = surface(AT_LEFT_EDGE, band_px, True)
    before, after = answer.matched, answer.disparity
    stands = after.origin == Origin.MATCHED
    np.testing.assert_array_equal(after.disparity_px[stands], before.disparity_px[stands])
    np.testing.assert_array_equal(after.sigma_px[stands], before.sigma_px[stands])
    # None is invented; a few are withdrawn: in the strip, and at the near rectangle's left edge.
    assert (before.origin[stands] == Origin.MATCHED).all()
    withdrawn = (before.origin == Origin.MATCHED) & ~stands
    assert 0 < withdrawn.mean() < 0.01
    assert (after.origin[withdrawn] == Origin.FILLED_INTERIOR).any()
    near_edge = part(edge_distance_px(), AT_LEFT_EDGE) < 16.0
    assert (near_edge | part(X - WALL < 9.0, AT_LEFT_EDGE))[withdrawn].all()
    # What is filled never claims to be measured well.
    filled = np.isfinite(after.disparity_px) & ~stands
    assert after.sigma_px[filled].min() > np.nanmax(before.sigma_px)


@EVERY_RESOLUTION
def test_the_fill_leaves_no_pixel_out(band_px: tuple[float, float]) -> None:
    found = surface(INSIDE, band_px, True).disparity
    assert np.isfinite(found.disparity_px[1:-1]).all()


def test_a_pixel_far_from_what_was_measured_stays_unknown() -> None:
    limited = match_surface(scene(AT_LEFT_EDGE), FULL, fills=True, max_gap_px=8).disparity
    strip_px = np.median(np.sum(part(X - WALL < 0.0, AT_LEFT_EDGE), axis=1))
    assert strip_px > 20
    assert np.isnan(limited.disparity_px[:, : int(strip_px) - 12]).all()
    assert np.isfinite(limited.disparity_px[1:-1, int(strip_px) + 12 :]).mean() > 0.95


# --- on a support -------------------------------------------------------------------------------

BOX = Box(160, 60, 200, 104)
# Without texture in both pictures; a support that is wrong well inside it only.
PATCH = (X >= 240) & (X < 280) & (Y >= 92) & (Y < 132)
HUMP = np.maximum(1.0 - ((X - 259.5) ** 2 + (Y - 111.5) ** 2) / 14.0**2, 0.0)
NOT_EXPECTED = (X >= 310) | ((X < 190) & (Y < 80))


@lru_cache
def patched() -> RectifiedPair:
    """The wall alone, with a grey patch."""
    pair = shifted_pair(WALL, BOX)
    rng = np.random.default_rng(1)
    seen = np.zeros(PATCH.shape, dtype=bool)
    rows, columns = np.nonzero(PATCH)
    seen[rows, np.round(columns - WALL[rows, columns]).astype(int)] = True
    left, right = (
        np.where(is_grey, 128.0 + rng.normal(0.0, 1.0, PATCH.shape), picture)
        for is_grey, picture in ((PATCH, pair.left), (seen, pair.right))
    )
    as_picture = (np.clip(np.round(p), 0, 255).astype(np.uint8) for p in (left, right))
    return RectifiedPair(*as_picture, pair.geometry, BOX)


def support(wrong_px: float = 0.0) -> np.ndarray:
    expected = np.where(NOT_EXPECTED, np.nan, WALL + wrong_px * HUMP)
    return part(expected, BOX).astype(np.float32)


@pytest.mark.parametrize("off_px", [0.0, 0.3, -0.3])
def test_on_a_support_the_pictures_tell_the_disparity(off_px: float) -> None:
    answer = match_on_support(patched(), support() + np.float32(off_px), fills=False)
    error = answer.disparity.disparity_px - part(WALL, BOX)
    is_textured = ~part(PATCH | NOT_EXPECTED, BOX)
    assert np.isfinite(error[is_textured]).mean() > 0.9
    assert np.nanmedian(np.abs(error)) < 0.03
    assert abs(np.nanmean(error)) < 0.01
    assert set(np.unique(answer.disparity.origin)) == {Origin.UNKNOWN, Origin.MATCHED}


@pytest.mark.parametrize("fills", [True, False])
def test_where_no_surface_is_expected_nothing_is_answered(fills: bool) -> None:
    found = match_on_support(patched(), support(), fills=fills).disparity
    nowhere = part(NOT_EXPECTED, BOX)
    assert np.isnan(found.disparity_px[nowhere]).all()
    assert np.isnan(found.sigma_px[nowhere]).all()
    assert (found.origin[nowhere] == Origin.UNKNOWN).all()


def test_where_a_surface_is_expected_the_fill_leaves_no_pixel_out() -> None:
    found = match_on_support(patched(), support(), fills=True).disparity
    expected = ~part(NOT_EXPECTED, BOX)
    assert np.isfinite(found.disparity_px[1:-1][expected[1:-1]]).all()


@pytest.mark.parametrize("wrong_px", [6.0, -6.0, 20.0])
def test_a_fill_comes_from_the_measured_neighbours_never_from_the_support(wrong_px: float) -> None:
    answer = match_on_support(patched(), support(wrong_px), fills=True)
    inside = part((X >= 245) & (X < 275) & (Y >= 97) & (Y < 127), BOX)
    assert np.isnan(answer.matched.disparity_px[inside]).all()
    filled = answer.disparity.disparity_px
    error = np.abs(filled - part(WALL, BOX))[inside]
    assert np.median(error) < 0.1
    assert error.max() < 1.0
    where_wrong = part(HUMP > 0.5, BOX)
    assert np.abs(filled - support(wrong_px))[where_wrong].min() > 2.0
    assert (answer.disparity.origin[inside] >= Origin.FILLED_INTERIOR).all()


def test_matches_on_a_support_keep_their_value_through_the_fill() -> None:
    answer = match_on_support(patched(), support(), fills=True)
    matched = answer.matched.origin == Origin.MATCHED
    assert (answer.disparity.origin[matched] == Origin.MATCHED).all()
    np.testing.assert_array_equal(
        answer.disparity.disparity_px[matched], answer.matched.disparity_px[matched]
    )
    alone = match_on_support(patched(), support(), fills=False).disparity
    np.testing.assert_array_equal(alone.disparity_px, answer.matched.disparity_px)


def test_what_a_fold_of_the_support_hides_is_an_interior_occlusion() -> None:
    expected = part(TRUTH, INSIDE).astype(np.float32)
    found = match_on_support(scene(INSIDE), expected, fills=True).disparity
    is_hidden = part(IS_HIDDEN, INSIDE)
    is_interior = found.origin == Origin.FILLED_INTERIOR
    assert is_interior[is_hidden].mean() > 0.7
    error = np.abs(found.disparity_px - part(WALL, INSIDE))[is_hidden & is_interior]
    assert np.percentile(error, 90) < 1.0


@pytest.mark.parametrize("fills", [True, False])
@pytest.mark.parametrize("chain", ["surface", "support"])
def test_every_part_is_timed(chain: str, fills: bool) -> None:
    started = time.perf_counter_ns()
    if chain == "surface":
        timings = match_surface(scene(INSIDE), FULL, fills=fills).timings
    else:
        timings = match_on_support(patched(), support(), fills=fills).timings
    elapsed_ms = (time.perf_counter_ns() - started) / 1e6
    assert timings.stereo_ms > 0.0
    assert (timings.fill_ms > 0.0) is fills
    # The parts do not overlap.
    assert timings.total_ms == timings.stereo_ms + timings.fill_ms <= elapsed_ms


@pytest.mark.parametrize("level", [0, 255])
@pytest.mark.parametrize("chain", [match_scene, match_surface])
def test_pictures_without_contrast_give_a_reason(chain, level: int) -> None:
    flat = np.full((HEIGHT, WIDTH), level, dtype=np.uint8)
    answer = chain(replace(scene(INSIDE), left=flat, right=flat), FULL, fills=True)
    assert np.isnan(answer.disparity.disparity_px).all()
    assert "contrast" in answer.reasons[0]


@pytest.mark.parametrize("fills", [False, True])
@pytest.mark.parametrize("chain", [match_scene, match_surface])
def test_of_a_box_that_leaves_the_picture_the_inside_is_matched(chain, fills: bool) -> None:
    pair = replace(scene(INSIDE), box=Box(200, -20, 400, 200))
    answer = chain(pair, FULL, fills=fills)
    found = answer.disparity
    assert (found.x, found.y) == (200, 0)
    assert found.disparity_px.shape == (180, WIDTH - 200)
    error = found.disparity_px - TRUTH[:180, 200:]
    assert np.nanmedian(np.abs(error)) < 0.1
    assert found.matched_fraction > 0.7
