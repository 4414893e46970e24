"""Compiled blending, beside the same in numpy."""

import numpy as np
import pytest

from navapp.overlay.blend_kernels import blend_colour, compute_face_tints, find_weights, tint_faces

pytestmark = pytest.mark.kernel

SHAPE = (20, 30)


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
    depth = rng.choice([np.nan, 390.0, 399.0, 402.0, 500.0], SHAPE).astype(np.float32)
    is_guess = np.isnan(depth) | (rng.random(SHAPE) < 0.3)
    in_front = rng.choice([0.0, 0.4, 1.0], SHAPE).astype(np.float32)
    weight = np.empty(SHAPE, dtype=np.float32)
    find_weights(bone, depth, is_guess, in_front, 2.5, 395.0, 0.55, guess, weight)
    with np.errstate(invalid="ignore"):
        is_aside = np.isnan(bone) & (depth < 395.0)
        is_beneath = depth < bone - 2.5
    seen = np.where(is_aside, 0.0, 1.0 - in_front)
    np.testing.assert_allclose(
        weight, np.where(is_guess, guess, np.where(is_beneath, 0.55, 1.0)) * seen, atol=1e-6
    )
    assert {0.0, 0.55, 1.0} <= set(np.round(np.unique(weight).astype(float), 6))


def test_a_steep_triangle_has_a_larger_share() -> None:
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces = rng.integers(0, 30, (50, 3)).astype(np.int32)
    towards = np.array([0.6, 0.0, -0.8])
    found = compute_face_tints(normals, faces, towards, 0.1, 0.35)
    facing = np.abs(normals @ towards)[faces].mean(axis=1)
    np.testing.assert_allclose(found, 0.1 + 0.35 * (1.0 - facing), rtol=1e-6)
