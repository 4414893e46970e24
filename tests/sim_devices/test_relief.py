import numpy as np

from sim_devices.relief import Bumps, make_waves


def test_equal_generators_give_equal_waves():
    points = np.random.default_rng(1).uniform(-50.0, 50.0, (100, 3))
    first, again, other = (
        make_waves(np.random.default_rng(s), 0.2, (6.0, 25.0)) for s in (3, 3, 4)
    )
    np.testing.assert_array_equal(first(points), again(points))
    assert np.abs(first(points) - other(points)).max() > 0.1


def test_waves_are_the_sum_they_say():
    relief = make_waves(np.random.default_rng(3), 0.2, (6.0, 25.0), count=4)
    points = np.random.default_rng(2).uniform(-120.0, 120.0, (50, 3))
    expected = sum(
        a * np.cos(points @ k + phase)
        for a, k, phase in zip(
            relief.amplitudes_mm, relief.wave_vectors, relief.phases_rad, strict=True
        )
    )
    np.testing.assert_allclose(relief(points), expected, atol=1e-4)


def test_bumps_are_gaussians():
    bumps = Bumps(np.array([[40.0, 5.0, -20.0], [0.0, 0.0, 0.0]]), np.array([2.0, 3.0]), np.ones(2))
    at = np.array([[40.0, 5.0, -20.0], [42.0, 5.0, -20.0], [0.0, 6.0, 0.0]])
    np.testing.assert_allclose(bumps(at), [1.0, np.exp(-0.5), np.exp(-2.0)], atol=1e-4)
