"""The veil's compiled blending."""

import numpy as np
import pytest

from navapp.overlay.tint_kernels import compute_face_tints, tint_pixels

pytestmark = pytest.mark.kernel


def test_pixels_of_the_mesh_are_blended_and_no_others() -> None:
    rng = np.random.default_rng(2)
    before = rng.integers(0, 256, (20, 30, 3), dtype=np.uint8)
    faces = rng.integers(-1, 5, (20, 30)).astype(np.int32)
    share = np.array([0.0, 0.2, 0.45, 0.8, 1.0], dtype=np.float32)
    image = before.copy()
    tint_pixels(image, faces, share, (120, 230, 60))
    weight = np.where(faces >= 0, share[np.maximum(faces, 0)], 0.0)[..., None]
    expected = before * (1.0 - weight) + np.array([120, 230, 60]) * weight
    assert np.abs(image - expected).max() <= 1.0
    np.testing.assert_array_equal(image[faces < 0], before[faces < 0])
    np.testing.assert_array_equal(image[faces == 4][:, 1], 230)


def test_a_steep_triangle_has_a_larger_share() -> None:
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces = rng.integers(0, 30, (50, 3)).astype(np.int32)
    towards = np.array([0.6, 0.0, -0.8])
    found = compute_face_tints(normals, faces, towards, 0.1, 0.35)
    facing = np.abs(normals @ towards)[faces].mean(axis=1)
    np.testing.assert_allclose(found, 0.1 + 0.35 * (1.0 - facing), rtol=1e-6)
