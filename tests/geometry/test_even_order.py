import numpy as np

from navapp.geometry.even_order import order_evenly


def test_any_first_points_are_spread() -> None:
    points = np.random.default_rng(1).uniform(0, 10, (3000, 3))
    order = order_evenly(points)
    assert sorted(order) == list(range(3000))
    for n in (64, 200):
        octants = (points[order[:n]] > 5) @ (1, 2, 4)
        counts = np.bincount(octants, minlength=8)
        assert counts.min() > 0.6 * n / 8
    chance = np.bincount((points[:64] > 5) @ (1, 2, 4), minlength=8)
    assert np.ptp(np.bincount((points[order[:64]] > 5) @ (1, 2, 4), minlength=8)) < np.ptp(chance)
