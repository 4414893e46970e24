import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from navapp.geometry.transform import rotation_from_vector
from navapp.registration.pairing_kernels import Pose, make_pairs
from navapp.registration.step_kernels import (
    add_point_system,
    apply_twist,
    find_weighted_centre,
    noise_under_kernel_mm2,
    solve_step,
    sum_plane_system,
    sum_size_terms,
    weigh,
)
from tests.reference import bimcc_reference as reference
from tests.registration.kernel_cases import make_case, measured_pairs

N_SIGMAS = 2.5
CENTRE = np.array([3.0, -4.0, 5.0])
LEVER_MM = 17.0


def weighed_pairs():
    case = make_case()
    pairs, n, measured, vertex = measured_pairs(case)
    weigh(pairs, n, 1.1, N_SIGMAS, 0.0)
    return case, pairs, n, measured, vertex


@pytest.mark.kernel
@pytest.mark.parametrize("sigma_mm", [0.3, 1.2, 12.0])
@pytest.mark.parametrize("noise_mm2", [0.0, 0.25])
def test_the_weights_are_those_of_the_reference(sigma_mm: float, noise_mm2: float) -> None:
    pairs, n, measured, _ = measured_pairs(make_case())
    sums = weigh(pairs, n, sigma_mm, N_SIGMAS, noise_mm2)
    kernels, weight = reference.weigh(measured, sigma_mm, N_SIGMAS, noise_mm2)
    np.testing.assert_allclose(pairs.weight[:n], weight, rtol=1e-9)
    assert sums.kernels == pytest.approx(kernels.sum(), rel=1e-9)
    assert sums.squares_mm2 == pytest.approx((kernels * measured.residual**2).sum(), rel=1e-9)
    assert sums.variances_mm2 == pytest.approx(
        (kernels * (measured.variance + noise_mm2)).sum(), rel=1e-9
    )


def test_under_a_wide_kernel_only_the_variance_weighs() -> None:
    pairs, n, _, _ = measured_pairs(make_case())
    sums = weigh(pairs, n, 1e9, N_SIGMAS, 0.0)
    assert sums.kernels == pytest.approx(n)
    np.testing.assert_allclose(pairs.weight[:n] * pairs.variance[:n], 1.0)


@pytest.mark.parametrize("noise_mm", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("sigma_mm", [1.0, 2.5])
def test_the_noise_is_found_beneath_the_kernel(noise_mm: float, sigma_mm: float) -> None:
    residual = np.random.default_rng(1).normal(0.0, noise_mm, 200_000)
    kernel = np.exp(-0.5 * (residual / sigma_mm) ** 2)
    squares = float((kernel * residual**2).sum())
    found = noise_under_kernel_mm2(squares, float(kernel.sum()), sigma_mm)
    assert found**0.5 == pytest.approx(noise_mm, rel=0.01)


@pytest.mark.kernel
def test_the_noise_is_that_of_the_reference_and_at_most_the_kernel() -> None:
    pairs, n, measured, _ = measured_pairs(make_case())
    for sigma_mm in (0.2, 0.6, 3.0):
        sums = weigh(pairs, n, sigma_mm, N_SIGMAS, 0.0)
        kernels, _ = reference.weigh(measured, sigma_mm, N_SIGMAS, 0.0)
        expected = reference.noise_under_kernel_mm2(measured, kernels, sigma_mm)
        found = noise_under_kernel_mm2(sums.squares_mm2, sums.kernels, sigma_mm)
        assert found == pytest.approx(expected, rel=1e-9)
    # Residuals that do not thin out within the kernel are no noise that it can tell.
    assert noise_under_kernel_mm2(3.0, 4.0, 1.0) == 1.0
    assert noise_under_kernel_mm2(40.0, 4.0, 1.0) == 1.0
    assert noise_under_kernel_mm2(0.0, 0.0, 1.0) == 0.0


@pytest.mark.kernel
def test_the_centre_is_the_weighted_mean_and_the_lever_its_spread() -> None:
    _, pairs, n, measured, _ = weighed_pairs()
    centre, lever = find_weighted_centre(pairs, n)
    expected, spread = reference.weighted_centre(measured.point, pairs.weight[:n])
    np.testing.assert_allclose(centre, expected, atol=1e-9)
    assert lever == pytest.approx(spread, rel=1e-9)


def test_a_lever_is_never_nothing() -> None:
    pairs = make_pairs(5)
    assert 0.0 < find_weighted_centre(pairs, 5)[1] < 1e-3
    pairs.weight[:] = 1.0
    assert 0.0 < find_weighted_centre(pairs, 5)[1] < 1e-3


@pytest.mark.kernel
def test_the_plane_system_is_that_of_the_reference() -> None:
    _, pairs, n, measured, _ = weighed_pairs()
    H, g = sum_plane_system(pairs, n, CENTRE, LEVER_MM)
    H_expected, g_expected = reference.plane_system(measured, pairs.weight[:n], CENTRE, LEVER_MM)
    np.testing.assert_allclose(H, H_expected, atol=1e-9 * np.abs(H_expected).max())
    np.testing.assert_allclose(g, g_expected, atol=1e-9 * np.abs(H_expected).max())


@pytest.mark.kernel
def test_the_terms_of_the_size_are_those_of_the_reference() -> None:
    _, pairs, n, measured, _ = weighed_pairs()
    mixed, *found = sum_size_terms(pairs, n, CENTRE, LEVER_MM)
    expected = reference.size_terms(measured, pairs.weight[:n], CENTRE, LEVER_MM)
    np.testing.assert_allclose(mixed, expected[0], atol=1e-9 * np.abs(expected[0]).max())
    np.testing.assert_allclose(found, expected[1:], rtol=1e-9)


@pytest.mark.kernel
def test_the_point_system_is_added_as_by_the_reference() -> None:
    case, pairs, n, measured, vertex = weighed_pairs()
    H, g = sum_plane_system(pairs, n, CENTRE, LEVER_MM)
    H_before, g_before = H.copy(), g.copy()
    add_point_system(pairs, n, case.model, 0.1, CENTRE, LEVER_MM, H, g)
    H_expected, g_expected = reference.point_system(
        measured, case.model, vertex, 0.1 * pairs.weight[:n], CENTRE, LEVER_MM
    )
    scale = np.abs(H_before).max()
    np.testing.assert_allclose(H - H_before, H_expected, atol=1e-9 * scale)
    np.testing.assert_allclose(g - g_before, g_expected, atol=1e-9 * scale)


@pytest.mark.kernel
def test_the_gradients_are_slopes_of_the_weighted_squares() -> None:
    """Half the weighted squares, planes and a tenth of the points, after a small twist."""
    case, pairs, n, measured, vertex = weighed_pairs()
    H, g = sum_plane_system(pairs, n, CENTRE, LEVER_MM)
    add_point_system(pairs, n, case.model, 0.1, CENTRE, LEVER_MM, H, g)

    def half_squares(step: np.ndarray) -> float:
        twist = np.append(step[:3] / LEVER_MM, step[3:])
        turn, shift = reference.apply_twist(twist, CENTRE, np.eye(3), np.zeros(3))
        moved = measured.point @ turn.T + shift
        plane = measured.residual + ((moved - measured.point) * measured.direction).sum(axis=1)
        point2 = ((moved - case.model.points[vertex]) ** 2).sum(axis=1)
        return float(0.5 * pairs.weight[:n] @ (plane**2 + 0.1 * point2))

    steps = 1e-4 * np.eye(6)
    slope = [(half_squares(s) - half_squares(-s)) / 2e-4 for s in steps]
    np.testing.assert_allclose(g, slope, rtol=1e-5, atol=1e-6 * np.abs(g).max())


@pytest.mark.kernel
def test_the_step_is_that_of_the_reference_and_goes_downhill() -> None:
    _, pairs, n, _, _ = weighed_pairs()
    H, g = sum_plane_system(pairs, n, CENTRE, LEVER_MM)
    twist = solve_step(H, g, LEVER_MM)
    np.testing.assert_allclose(twist, reference.solve_step(H, g, LEVER_MM), atol=1e-9)
    assert np.append(twist[:3] * LEVER_MM, twist[3:]) @ g < 0.0


@pytest.mark.kernel
def test_a_large_step_is_capped_in_both_parts() -> None:
    H, g = np.eye(6), np.array([300.0, 400.0, 0.0, 0.0, -600.0, 800.0])
    twist = solve_step(H, g, 10.0)
    np.testing.assert_allclose(twist, (-0.15, -0.2, 0.0, 0.0, 6.0, -8.0), atol=1e-9)
    np.testing.assert_allclose(twist, reference.solve_step(H, g, 10.0), atol=1e-9)


def test_a_direction_that_nothing_fixes_stays_where_it_is() -> None:
    H = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    twist = solve_step(H, np.array([0.1, 0.0, 0.0, 0.2, 0.0, 0.0]), 1.0)
    np.testing.assert_allclose(twist, (-0.1, 0.0, 0.0, -0.2, 0.0, 0.0), atol=1e-6)
    np.testing.assert_array_equal(solve_step(np.zeros((6, 6)), np.zeros(6), 1.0), 0.0)


coordinates = st.floats(-3.0, 3.0)


@pytest.mark.kernel
@given(st.lists(coordinates, min_size=12, max_size=12), st.sampled_from([1.0, 1e-4, 1e-9, 0.0]))
@settings(max_examples=60, deadline=None)
def test_a_twist_moves_the_pose_as_by_the_reference(values: list[float], size: float) -> None:
    twist, centre = np.array(values[:6]), np.array(values[6:9]) * 30.0
    twist[:3] *= size
    R, t = rotation_from_vector(values[9:]), np.array(values[3:6]) * 20.0
    expected = reference.apply_twist(twist, centre, R.copy(), t.copy())
    apply_twist(twist, centre, Pose(R, t))
    np.testing.assert_allclose(R, expected[0], atol=1e-12)
    np.testing.assert_allclose(t, expected[1], atol=1e-9)
