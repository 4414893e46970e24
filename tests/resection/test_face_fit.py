"""A plane through disparities."""

import numpy as np
import pytest

from navapp.resection import face_fit
from navapp.resection.face_fit import (
    disparity_coefficients,
    find_covariance,
    fit_disparity_plane,
    plane_in_camera,
)
from tests.many import few_of
from tests.stereo.pairs import geometry

PLANE = np.array([0.02, -0.03, 130.0])
SHIFT = np.array([0.002, 0.002, 0.5])


def places(n: int = 90) -> np.ndarray:
    u, v = np.meshgrid(np.arange(-n, n, 2.0), np.arange(-n, n, 2.0))
    return np.column_stack([u.ravel(), v.ravel(), np.ones(u.size)])


def measured(seed: int, share_off: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, disparities with noise that goes together over a window, and their deviation."""
    import cv2

    rng = np.random.default_rng(seed)
    where = places()
    side = int(np.sqrt(len(where)))
    white = rng.normal(0.0, 1.0, (side, side))
    noise = cv2.blur(white, (5, 5)) * 5.0 * 0.05
    disparity = where @ PLANE + 2.0 * noise.ravel()
    is_off = where[:, 0] < -90.0 + 180.0 * share_off
    disparity[is_off] += 2.5
    return where, disparity, np.full(len(where), 0.1)


def test_a_plane_becomes_disparities_and_back() -> None:
    pair = geometry()
    normal = np.array([0.2, -0.3, -0.9])
    normal /= np.linalg.norm(normal)
    coefficients = disparity_coefficients(normal, -410.0, pair)
    found, distance_mm = plane_in_camera(coefficients, pair)
    np.testing.assert_allclose(found, normal, atol=1e-12)
    assert distance_mm == pytest.approx(-410.0)
    # A point of the plane has the disparity that its depth says.
    point = -410.0 * normal
    u, v = (pair.project(point[None])[0] - (pair.centre_x_px, pair.centre_y_px)).tolist()
    assert coefficients @ (u, v, 1.0) == pytest.approx(pair.disparity_px(float(point[2])))


@pytest.mark.parametrize("share_off", [0.0, 0.35])
def test_the_covariance_belongs_to_the_error(
    share_off: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(face_fit, "_COMMON_PX", 0.0)
    off = []
    for seed in range(40):
        fit = fit_disparity_plane(*measured(seed, share_off), PLANE + SHIFT, 3.0)
        assert fit is not None
        error = fit.coefficients - PLANE
        off.append(error @ np.linalg.solve(fit.covariance, error))
        assert np.abs(error @ places().T).max() < 0.15
    # Of three numbers: the mean of chi-square is 3.
    assert 1.5 < np.mean(off) < 4.5


def test_the_covariance_is_that_of_errors_that_neighbours_share() -> None:
    where, rng = places(24), np.random.default_rng(3)
    weight, residual = rng.uniform(0.5, 1.5, len(where)), rng.normal(0.0, 0.05, len(where))
    apart_px = np.linalg.norm(where[:, None, :2] - where[None, :, :2], axis=2)
    shared = np.exp(-0.5 * (apart_px / face_fit._TOGETHER_PX) ** 2)
    n_apart = weight.sum() ** 2 / (weight @ shared @ weight)
    noise_px2 = np.average(residual**2, weights=weight**2) * n_apart / (n_apart - 3.0)
    growth = 0.8 * weight
    solve = np.linalg.inv((where * growth[:, None]).T @ where) @ (where * weight[:, None]).T
    expected = noise_px2 * solve @ shared @ solve.T + np.diag([0.0, 0.0, face_fit._COMMON_PX**2])
    found = find_covariance(where, weight, growth, residual)
    assert found is not None
    np.testing.assert_allclose(found, expected, rtol=2e-3, atol=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize("noise_px", few_of([0.05, 0.1, 0.15]))
@pytest.mark.parametrize("half_px", [(30, 6), (20, 10), (30, 30)])
def test_bounds_of_narrow_faces_hold(
    half_px: tuple[int, int], noise_px: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    import cv2

    monkeypatch.setattr(face_fit, "_COMMON_PX", 0.0)
    monkeypatch.setattr(face_fit, "_LEAST_NOISE_PX", 0.0)
    u, v = np.meshgrid(*(np.arange(-n, n, 2.0) for n in half_px))
    where, rng = np.column_stack([u.ravel(), v.ravel(), np.ones(u.size)]), np.random.default_rng(5)
    sigma = np.full(len(where), 0.1)
    n_held, n = 0, 120
    for _ in range(n):
        white = rng.normal(0.0, 1.0, (2 * half_px[1] + 40, 2 * half_px[0] + 40))
        blurred = cv2.GaussianBlur(white, (0, 0), face_fit._TOGETHER_PX / 2**0.5)
        noise = noise_px * (blurred / blurred.std())[20:-20:2, 20:-20:2]
        fit = fit_disparity_plane(where, where @ PLANE + noise.ravel(), sigma, PLANE, 1.0)
        assert fit is not None
        error = fit.coefficients - PLANE
        n_held += error @ np.linalg.solve(fit.covariance, error) <= 7.81
    assert n_held >= 0.85 * n


def test_what_lies_elsewhere_is_not_on_it() -> None:
    where, disparity, sigma = measured(1, 0.35)
    fit = fit_disparity_plane(where, disparity, sigma, PLANE, 1.0)
    assert fit is not None
    np.testing.assert_array_equal(fit.is_on[where[:, 0] < -30.0], False)
    assert fit.is_on[where[:, 0] > -20.0].mean() > 0.98


@pytest.mark.parametrize("kept", [slice(0, 40), slice(0, 2)])
def test_too_little_tells_nothing(kept: slice) -> None:
    values = [one[kept] for one in measured(1)]
    assert fit_disparity_plane(*values, PLANE, 1.0) is None
