import numpy as np

from sim_devices.textures import STEPS_PER_SIGMA, make_noise_tile, make_smooth_noise


def channels(tile):
    return np.stack([tile.values & 255, tile.values >> 8], axis=-1).astype(float)


def test_a_tile_has_the_promised_mean_and_deviation():
    values = channels(make_noise_tile(1, size=64))
    np.testing.assert_allclose(values.mean(axis=(0, 1, 2)), 128.0, atol=1.5)
    np.testing.assert_allclose(values.std(axis=(0, 1, 2)), STEPS_PER_SIGMA, rtol=0.1)


def test_the_channels_are_unrelated():
    values = channels(make_noise_tile(2, size=64)).reshape(-1, 2)
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.15


def test_a_tile_is_periodic():
    values = channels(make_noise_tile(3, size=64))[..., 0]
    inside = np.abs(np.diff(values, axis=0)).mean()
    across = np.abs(values[0] - values[-1]).mean()
    assert 0.8 < across / inside < 1.25


def test_every_octave_has_similar_contrast():
    values = channels(make_noise_tile(4))[..., 0] - 128.0
    power = np.abs(np.fft.fftn(values)) ** 2
    axis = np.fft.fftfreq(len(values))
    radius = np.sqrt(axis[:, None, None] ** 2 + axis[None, :, None] ** 2 + axis[None, None] ** 2)
    octaves = [power[(radius >= low) & (radius < 2 * low)].sum() for low in (1 / 24, 1 / 12, 1 / 6)]
    assert max(octaves) / min(octaves) < 2.0


def test_a_blur_lowers_the_contrast():
    sharp, soft = (channels(make_noise_tile(5, blur, 64))[..., 0].std() for blur in (0.0, 1.0))
    assert soft < 0.85 * sharp


def test_equal_seeds_give_equal_tiles_and_others_do_not():
    first = make_noise_tile(6, size=32).values
    make_noise_tile.cache_clear()
    np.testing.assert_array_equal(make_noise_tile(6, size=32).values, first)
    assert (make_noise_tile(7, size=32).values != first).mean() > 0.9


def test_shape_noise_has_about_unit_deviation_and_no_mean():
    points = np.random.default_rng(1).uniform(0, 1000, (20000, 2))
    values = make_smooth_noise(points, 20.0, 3)
    assert abs(values.mean()) < 0.1
    assert 0.8 < values.std() < 1.2
