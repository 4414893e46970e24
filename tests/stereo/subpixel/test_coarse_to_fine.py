"""From a coarse map to a surface measured to a part of a pixel."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.coarse import calm, smooth_steps
from navapp.stereo.subpixel.coarse_to_fine import refine_surface
from navapp.stereo.subpixel.refine import refine
from navapp.values import Origin
from tests.stereo.pairs import HEIGHT, WIDTH, shifted_pair

Y, X = np.mgrid[:HEIGHT, :WIDTH].astype(float)
BOX = Box(80, 8, 200, 104)
SLANTED = 30.0 + 0.06 * X + 0.04 * Y
CURVED = 40.0 + 0.03 * X - 3e-4 * (X - 170.0) ** 2 - 8e-4 * (Y - 60.0) ** 2
EDGE_X = 180
WALL = 30.0 + 0.02 * X
NEAR = np.full(X.shape, 42.0)
EDGE = np.where(X < EDGE_X, WALL, NEAR)


def in_box(values: np.ndarray) -> np.ndarray:
    rows, columns = slice(BOX.y, BOX.y + BOX.height), slice(BOX.x, BOX.x + BOX.width)
    return values[rows, columns].astype(np.float32)


def stepped(truth: np.ndarray) -> np.ndarray:
    """What a matcher of whole disparities finds."""
    return np.round(in_box(truth))


def pair_before_wall(is_near: np.ndarray) -> RectifiedPair:
    """Parts of a near plane stand before a wall; each camera sees another part of the wall."""
    wall, near = (shifted_pair(d, BOX, seed) for seed, d in enumerate((WALL, NEAR)))
    left = np.where(is_near, near.left, wall.left)
    right = np.where(np.roll(is_near, -42, axis=1), near.right, wall.right)
    return replace(wall, left=left, right=right)


def without_texture(pair: RectifiedPair, truth: np.ndarray, patch: np.ndarray) -> RectifiedPair:
    """Both pictures grey, but for the sensor's noise, where the left one shows the patch."""
    rng = np.random.default_rng(1)
    seen = np.zeros(patch.shape, dtype=bool)
    rows, columns = np.nonzero(patch)
    seen[rows, np.round(columns - truth[rows, columns]).astype(int)] = True
    pictures = [
        np.where(is_grey, 128.0 + rng.normal(0.0, 1.0, patch.shape), picture)
        for is_grey, picture in ((patch, pair.left), (seen, pair.right))
    ]
    left, right = (np.clip(np.round(p), 0, 255).astype(np.uint8) for p in pictures)
    return replace(pair, left=left, right=right)


@pytest.mark.parametrize("slope", [0.15, 0.2, 0.3])
def test_the_steps_of_a_slanted_surface_vanish(slope: float) -> None:
    truth = 30.0 + slope * X
    error = smooth_steps(stepped(truth)) - in_box(truth)
    assert np.isfinite(error).all()
    # Rounding alone has a deviation of 0.29 and jumps of 1.
    assert error.std() < 0.1
    assert np.abs(error[8:-8, 8:-8]).max() < 0.2
    assert np.abs(np.diff(error, axis=1)).max() < 0.15


@pytest.mark.parametrize("truth", [SLANTED, CURVED])
def test_long_steps_become_a_gentle_slope(truth: np.ndarray) -> None:
    surface = smooth_steps(stepped(truth))
    for axis in (0, 1):
        assert np.abs(np.diff(surface, axis=axis)).max() < 0.3
    assert (surface - in_box(truth)).std() < 0.75 * (stepped(truth) - in_box(truth)).std()


def test_single_holes_are_closed_and_larger_ones_stay_unknown() -> None:
    coarse = stepped(SLANTED)
    coarse[20, 30] = np.nan
    coarse[60:72, 100:112] = np.nan
    coarse[:30, 150:] = np.nan
    surface = smooth_steps(coarse)
    assert abs(surface[20, 30] - in_box(SLANTED)[20, 30]) < 0.5
    # One pixel from what is known is as near as the rim of a single hole.
    unknown = np.zeros(coarse.shape, dtype=bool)
    unknown[61:71, 101:111] = True
    unknown[:29, 151:] = True
    np.testing.assert_array_equal(np.isnan(surface), unknown)


def test_both_sides_of_an_edge_keep_their_own_values() -> None:
    error = np.abs(smooth_steps(stepped(EDGE)) - in_box(EDGE))
    beside = np.abs(in_box(X) - (EDGE_X - 0.5)) < 1.0
    assert error[~beside].max() < 0.6
    # At the very edge the surface may bend by less than would take a pixel across.
    assert error[beside].max() < 2.0


def test_a_thin_thing_before_a_wall_is_not_taken_for_the_wall() -> None:
    thin = in_box(np.where(np.abs(X - EDGE_X) < 3.0, 40.0, 30.0))
    np.testing.assert_allclose(smooth_steps(thin), thin, atol=0.01)


def test_nothing_known_stays_nothing() -> None:
    assert np.isnan(smooth_steps(np.full((40, 50), np.nan, dtype=np.float32))).all()


@pytest.mark.parametrize("truth", [SLANTED, CURVED])
@pytest.mark.parametrize("is_smooth", [True, False])
def test_a_rounded_map_becomes_a_measured_surface(truth: np.ndarray, is_smooth: bool) -> None:
    pair = shifted_pair(truth, BOX)
    coarse = smooth_steps(stepped(truth)) if is_smooth else stepped(truth)
    found = refine_surface(pair, coarse)
    error = found.disparity_px - in_box(truth)
    known = np.isfinite(error)
    assert known.mean() > 0.9
    assert np.median(np.abs(error[known])) < 0.05
    assert abs(np.mean(error[known])) < 0.005
    # What steps leave would follow the fraction of the disparity.
    wave = np.mean(error[known] * np.exp(2j * np.pi * in_box(truth)[known]))
    assert abs(wave) < 0.02
    np.testing.assert_array_equal(found.origin == Origin.MATCHED, known)
    np.testing.assert_array_equal(np.isfinite(found.sigma_px), known)
    assert (found.x, found.y) == (BOX.x, BOX.y)


@pytest.mark.parametrize("height_px", [1.0, -1.0])
def test_a_bump_that_the_pictures_do_not_show_is_not_handed_out(height_px: float) -> None:
    pair = shifted_pair(CURVED, BOX)
    bump = height_px * np.maximum(1.0 - ((X - 180.0) ** 2 + (Y - 60.0) ** 2) / 10.0**2, 0.0)
    coarse = smooth_steps(stepped(CURVED)) + in_box(bump)
    is_bump = in_box(bump) != 0.0
    error = (refine_surface(pair, coarse).disparity_px - in_box(CURVED))[is_bump]
    assert np.isfinite(error).mean() > 0.9
    assert np.nanmax(np.abs(error)) < 0.15
    assert abs(np.nanmean(error)) < 0.05
    # Without turns much of it is handed out, or lost.
    once = (refine(pair, coarse).disparity_px - in_box(CURVED))[is_bump]
    assert np.nanmax(np.abs(once)) > 0.2


def test_a_patch_without_texture_stays_unknown() -> None:
    patch = (X >= 150) & (X < 200) & (Y >= 40) & (Y < 80)
    pair = without_texture(shifted_pair(SLANTED, BOX), SLANTED, patch)
    found = refine_surface(pair, smooth_steps(stepped(SLANTED)))
    # A window reaches 5 px.
    within = in_box((X >= 155) & (X < 195) & (Y >= 45) & (Y < 75)) > 0
    around = in_box((X < 144) | (X >= 206) | (Y < 34) | (Y >= 86)) > 0
    assert np.isnan(found.disparity_px[within]).all()
    assert (found.origin[within] == Origin.UNKNOWN).all()
    error = (found.disparity_px - in_box(SLANTED))[around]
    assert np.isfinite(error).mean() > 0.9
    assert np.nanmedian(np.abs(error)) < 0.05


def test_an_edge_keeps_both_sides() -> None:
    coarse = stepped(EDGE)
    # What the near plane hides from the right camera has no match.
    hidden_x = EDGE_X - 9
    coarse[:, hidden_x - BOX.x : EDGE_X - BOX.x] = np.nan
    found = refine_surface(pair_before_wall(X >= EDGE_X), smooth_steps(coarse))
    error = np.abs(found.disparity_px - in_box(EDGE))
    columns = in_box(X)
    for beside in (
        (columns >= hidden_x - 20) & (columns < hidden_x - 8),
        (columns >= EDGE_X + 8) & (columns < EDGE_X + 20),
    ):
        assert np.isfinite(error[beside]).mean() > 0.9
        assert np.nanmax(error[beside]) < 0.2
    # A window that hangs over the edge answers for its own side, or not.
    assert np.nanmax(error) < 1.0


def test_a_narrow_thing_before_a_wall_keeps_its_place() -> None:
    is_near = (X >= 170) & (X < 180)
    truth = np.where(is_near, NEAR, WALL)
    coarse = stepped(truth)
    coarse[:, 161 - BOX.x : 170 - BOX.x] = np.nan
    found = refine_surface(pair_before_wall(is_near), smooth_steps(coarse))
    error = np.abs(found.disparity_px - in_box(truth))
    # The wall around it has more pixels to speak for the surface.
    on_it = in_box(is_near) > 0
    assert np.isfinite(error[on_it]).mean() > 0.7
    assert np.nanmedian(error[on_it]) < 0.25
    beside = in_box((X < 150) | (X >= 190)) > 0
    assert np.nanmax(error[beside]) < 0.2


def test_a_map_without_any_answer_measures_nothing() -> None:
    found = refine_surface(
        shifted_pair(SLANTED, BOX), np.full((BOX.height, BOX.width), np.nan, dtype=np.float32)
    )
    assert np.isnan(found.disparity_px).all()
    assert (found.origin == Origin.UNKNOWN).all()


def test_a_small_island_stays() -> None:
    coarse = np.full((60, 60), np.nan, np.float32)
    coarse[30:34, 30:34] = 20.0
    assert np.isfinite(smooth_steps(coarse)[30:34, 30:34]).all()


def test_a_calmed_map_has_less_noise_and_keeps_its_edges() -> None:
    rng = np.random.default_rng(8)
    true = np.where(np.arange(60) < 30, 20.0, 26.0) + 0.02 * np.arange(40)[:, None]
    noisy = (true + rng.uniform(-0.25, 0.25, true.shape)).astype(np.float32)
    noisy[10, 12] = np.nan
    noisy[20:30, 40:50] = np.nan
    found = calm(noisy)
    assert np.isfinite(found[10, 12])
    assert np.isnan(found[22:28, 42:48]).all()
    error = np.abs(found - true)
    known = np.isfinite(noisy)
    # An edge keeps its place: nothing lies between the two surfaces.
    assert np.nanmax(error[known]) < 0.5
    away = known & (np.abs(np.arange(60) - 29.5) > 3.0)
    assert np.std((found - true)[away]) < 0.5 * np.std((noisy - true)[away])
