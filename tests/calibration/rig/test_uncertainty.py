"""What a rig's numbers do to triangulated points."""

import numpy as np
import pytest

from calibration.rig.parameters import RigModel, pack, unpack
from calibration.rig.uncertainty import (
    compute_bounds_mm,
    compute_triangulation_slopes,
    make_working_points_mm,
)
from tests.calibration.marks import HEIGHT, WIDTH, drawn_rig

MODEL = RigModel(5, 0, WIDTH, HEIGHT)
SHARED = pack(MODEL, drawn_rig(np.random.default_rng(21)))
POINTS_MM = make_working_points_mm(MODEL, SHARED, (350.0, 550.0))[::7].copy()


def pixels_of(shared: np.ndarray, points_mm: np.ndarray) -> np.ndarray:
    """(n, 4) in both pictures."""
    rig = unpack(MODEL, shared)
    right = rig.right.project(rig.right_from_left.apply(points_mm))
    return np.hstack([rig.left.project(points_mm), right])


def triangulated(shared: np.ndarray, pixels: np.ndarray, start_mm: np.ndarray) -> np.ndarray:
    """(n, 3) points that leave least in both pictures, by Gauss-Newton with numeric slopes."""
    points_mm = start_mm.copy()
    for _ in range(3):
        slopes = np.stack(
            [
                (pixels_of(shared, points_mm + off) - pixels_of(shared, points_mm - off)) / 0.02
                for off in 0.01 * np.eye(3)
            ],
            axis=2,
        )
        left = pixels - pixels_of(shared, points_mm)
        points_mm += (np.linalg.pinv(slopes) @ left[:, :, None])[:, :, 0]
    return points_mm


def test_slopes_are_those_of_triangulation() -> None:
    pixels = pixels_of(SHARED, POINTS_MM)
    slopes = compute_triangulation_slopes(MODEL, SHARED, POINTS_MM)
    steps = [*[0.01] * 4, *[1e-4] * 5] * 2 + [1e-5] * 3 + [0.01] * 3
    for k, step in enumerate(steps):
        off = np.zeros(MODEL.n_shared)
        off[k] = step
        more = triangulated(SHARED + off, pixels, POINTS_MM)
        less = triangulated(SHARED - off, pixels, POINTS_MM)
        expected = (more - less) / (2.0 * step)
        size = np.abs(expected).max()
        np.testing.assert_allclose(slopes[:, :, k] / size, expected / size, atol=1e-3)


def test_so_many_rigs_of_a_covariance_err_by_less_than_the_bound() -> None:
    rng = np.random.default_rng(22)
    sigma = np.array([*[0.3] * 4, *[1e-3] * 2, *[1e-4] * 2, 1e-3] * 2 + [2e-4] * 3 + [0.02] * 3)
    mixed = rng.normal(size=(MODEL.n_rig, MODEL.n_rig)) / MODEL.n_rig**0.5
    root = sigma[:, None] * mixed
    bounds = compute_bounds_mm(MODEL, SHARED, root @ root.T, POINTS_MM)
    pixels = pixels_of(SHARED, POINTS_MM)
    held = [
        np.linalg.norm(triangulated(SHARED + off, pixels, POINTS_MM) - POINTS_MM, axis=1) < bounds
        for off in (root @ rng.normal(size=(MODEL.n_rig, 120))).T
    ]
    # Points of a rig err together: 120 rigs, not thousands of points.
    assert np.mean(held) == pytest.approx(0.95, abs=4.0 * (0.05 * 0.95 / 120) ** 0.5)
