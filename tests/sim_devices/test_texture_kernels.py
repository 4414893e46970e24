import numpy as np
import pytest

from sim_devices.texture_kernels import sample_surface, sample_tile
from sim_devices.textures import COARSE_VOXEL_MM, FINE_VOXEL_MM, make_noise_tile
from tests.reference import shading_reference


@pytest.fixture(scope="module")
def tile():
    return make_noise_tile(5, size=32).values


@pytest.mark.kernel
def test_tile_lookup_agrees_with_the_reference_and_is_periodic(tile):
    rng = np.random.default_rng(2)
    out, again = np.empty(5, np.float32), np.empty(5, np.float32)
    for point in rng.uniform(-90, 90, (200, 3)).astype(np.float32):
        sample_tile(tile, *point, out)
        values, gradient = shading_reference.sample(tile, point.astype(float))
        np.testing.assert_allclose(out[:2], values, atol=2e-4)
        np.testing.assert_allclose(out[2:], gradient, atol=2e-4)
        sample_tile(tile, *(point + np.float32(32.0)), again)
        np.testing.assert_allclose(again, out, atol=2e-3)


@pytest.mark.kernel
@pytest.mark.parametrize("lookups", [1, 2, 7])
def test_the_noise_of_a_pixel_agrees_with_the_reference(tile, lookups):
    rng = np.random.default_rng(6)
    out = np.empty((3, 5), np.float32)
    texture = np.array([-1.0, 3.0, 6.0, 2.0], np.float32)
    for point, across in rng.uniform(-9, 9, (50, 2, 3)).astype(np.float32):
        scales = np.float32(1.0 / FINE_VOXEL_MM), np.float32(1.0 / COARSE_VOXEL_MM)
        sample_surface(tile, scales, texture, point, across, lookups, out)
        mirror = np.array([-1.0, 1.0, 1.0])
        expected = shading_reference.sample_surface(
            tile, mirror * point + texture[1:], mirror * across, lookups
        )
        np.testing.assert_allclose(out[:2], expected, atol=1e-3)
