"""Compiled blending, beside the same in numpy."""

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.halves import double, half_box
from navapp.overlay.blend_kernels import (
    blend_colour,
    blend_outline,
    compute_face_tints,
    find_weights,
    lay_over,
    mark_dots,
    tint_faces,
)

pytestmark = pytest.mark.kernel

SHAPE = (20, 30)
# Its first pixel is the second one of a half pixel, in columns.
BOX = Box(5, 8, 30, 20)


def picture(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (*SHAPE, 3), dtype=np.uint8)


def blended(before: np.ndarray, share: np.ndarray, colour: np.ndarray) -> np.ndarray:
    return before + share[..., None] * (colour - before.astype(float))


@pytest.mark.parametrize("n_colours", [1, 5])
def test_pixels_of_the_mesh_are_blended_and_no_others(n_colours: int) -> None:
    rng, before = np.random.default_rng(2), picture(2)
    faces = rng.integers(-1, 5, SHAPE).astype(np.int32)
    share = np.array([0.0, 0.2, 0.45, 0.8, 1.0], dtype=np.float32)
    colours = rng.integers(0, 256, (n_colours, 3)).astype(np.float32)
    weight = rng.choice([0.0, 0.55, 1.0], SHAPE).astype(np.float32)
    image = before.copy()
    tint_faces(image, faces, share, colours, weight)
    part = np.where(faces >= 0, share[faces] * weight, 0.0)
    expected = blended(before, part, colours[faces % n_colours])
    assert np.abs(image - expected).max() <= 0.5 + 1e-3
    np.testing.assert_array_equal(image[part == 0.0], before[part == 0.0])


def test_one_colour_is_blended_by_its_share() -> None:
    before = picture(3)
    share = np.random.default_rng(3).uniform(-0.3, 1.0, SHAPE).astype(np.float32)
    image = before.copy()
    blend_colour(image, share, (120, 230, 60))
    expected = blended(before, np.maximum(share, 0.0), np.array([120, 230, 60]))
    assert np.abs(image - expected).max() <= 0.5 + 1e-3
    np.testing.assert_array_equal(image[share <= 0.0], before[share <= 0.0])


@pytest.mark.parametrize("guess", [0.55, 0.0])
def test_weights_tell_what_hides_and_what_lies_on_the_bone(guess: float) -> None:
    rng = np.random.default_rng(5)
    bone = rng.choice([np.nan, 400.0, 405.0], SHAPE).astype(np.float32)
    half = half_box(BOX)
    size = half.height, half.width
    half_depth = rng.choice([np.nan, 390.0, 399.0, 402.0, 500.0], size).astype(np.float32)
    half_guess = (np.isnan(half_depth) & (rng.random(size) < 0.7)) | (rng.random(size) < 0.3)
    depth, is_guess = double(half_depth, BOX), double(half_guess.view(np.uint8), BOX) > 0
    in_front = rng.choice([0, 102, 255], SHAPE).astype(np.uint8)
    weight, nearest = np.empty((2, *SHAPE), dtype=np.float32)
    hidden = np.empty(SHAPE, dtype=np.bool_)
    find_weights(
        bone, half_depth, half_guess.view(np.uint8), (BOX.x % 2, BOX.y % 2), in_front, 2.5, 395.0,
        0.55, guess, weight, nearest, hidden,
    )  # fmt: skip
    np.testing.assert_array_equal(nearest, np.fmin(bone, np.where(is_guess, np.nan, depth)))
    with np.errstate(invalid="ignore"):
        is_aside = np.isnan(bone) & (depth < 395.0)
        is_beneath = depth < bone - 2.5
    seen = np.where(is_aside, 0.0, 1.0 - in_front / 255.0)
    np.testing.assert_array_equal(hidden, (seen < 0.5) | (is_guess & (guess == 0.0)))
    np.testing.assert_allclose(
        weight, np.where(is_guess, guess, np.where(is_beneath, 0.55, 1.0)) * seen, atol=1e-6
    )
    assert {0.0, 0.55, 1.0} <= set(np.round(np.unique(weight).astype(float), 6))


@pytest.mark.parametrize("n_colours", [1, 40])
def test_colours_laid_over_each_other_blend_as_one_after_the_other(n_colours: int) -> None:
    rng, n = np.random.default_rng(6), 40
    layers = [
        (rng.choice([0.0, 0.3, 0.8, 1.0], n).astype(np.float32),
         rng.integers(0, 256, (n_colours, 3)).astype(np.float32))
        for _ in range(3)
    ]  # fmt: skip
    share, colour = np.zeros(n, np.float32), np.zeros((n, 3), np.float32)
    expected = before = rng.uniform(0.0, 255.0, (n, 3))
    for over_share, over_colour in layers:
        lay_over(share, colour, over_share, over_colour)
        expected = blended(expected, over_share, over_colour)
    np.testing.assert_allclose(blended(before, share, colour), expected, atol=1e-3)


def outlined(before, soft, weight, corner) -> np.ndarray:
    inside = soft / 255.0
    share = np.minimum(5.0 * inside * (1.0 - inside), 1.0)
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    is_left_out = ((rows + corner[1] + columns + corner[0]) // 6) % 2 == 1
    beneath = np.minimum(weight / 0.55, 1.0) * np.where(is_left_out, 0.25, 1.0)
    line = np.where(weight <= np.float32(0.55), beneath, weight)
    return blended(before, share * line, np.array([120, 230, 60]))


def test_an_outline_lies_at_the_edge_of_a_mask_in_stripes_where_it_is_beneath() -> None:
    rng, before = np.random.default_rng(7), picture(7)
    soft = rng.choice([0, 30, 128, 250, 255], SHAPE).astype(np.uint8)
    weight = rng.choice([0.0, 0.3, 0.55, 0.8, 1.0], SHAPE).astype(np.float32)
    image = before.copy()
    blend_outline(image, soft, weight, (7, 12), 6, 0.55, (120, 230, 60))
    expected = outlined(before, soft, weight, (7, 12))
    assert np.abs(image - expected).max() <= 0.5 + 1e-2


def test_dots_mark_points_that_the_bone_does_not_hide() -> None:
    bone = np.full(SHAPE, 400.0, dtype=np.float32)
    bone[:, 20:] = np.nan
    weight = np.full(SHAPE, 0.8, dtype=np.float32)
    pixels = np.array(
        [[3.3, 4.4], [10.0, 9.0], [24.0, 9.0], [0.4, 5.0], [28.6, 5.0], [np.nan, 2.0]]
    )
    share = np.zeros(SHAPE, dtype=np.float32)
    depth = np.array([400.5, 402.0, 900.0, 1.0, 1.0, 1.0])
    rows = mark_dots(pixels, depth, bone, weight, 1.0, share)
    expected = np.zeros(SHAPE, dtype=np.float32)
    for u, v in ((3, 4), (24, 9)):
        expected[v, u - 1 : u + 2] = expected[v - 1 : v + 2, u] = 0.8
    np.testing.assert_allclose(share, expected)
    assert rows == (3, 11)
    none = mark_dots(pixels[3:], depth[3:], bone, weight, 1.0, share)
    assert none[0] == none[1]


def test_a_steep_triangle_has_a_larger_share() -> None:
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces = rng.integers(0, 30, (50, 3)).astype(np.int32)
    towards = np.array([0.6, 0.0, -0.8])
    found = compute_face_tints(normals, faces, towards, 0.1, 0.35)
    facing = np.abs(normals @ towards)[faces].mean(axis=1)
    np.testing.assert_allclose(found, 0.1 + 0.35 * (1.0 - facing), rtol=1e-6)
