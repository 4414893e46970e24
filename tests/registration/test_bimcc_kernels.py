import numpy as np
import pytest

from navapp.registration.bimcc_kernels import (
    BimccSettings,
    choose_first_sigma_mm,
    run_coarse_loop,
    run_fine_loop,
)
from navapp.registration.pairing_kernels import make_pairs
from tests.reference import bimcc_reference as reference
from tests.registration.kernel_cases import Case, make_case


def settings_of(max_iterations: int = 1) -> BimccSettings:
    return BimccSettings(model_points=750, max_iterations=max_iterations)


def case_of(*, has_camera: bool, knows_noise: bool = False) -> Case:
    """Points that weigh by their noise, and a kernel that may or may not follow it."""
    case = make_case(has_camera=has_camera)
    case.scene = case.scene._replace(knows_noise=knows_noise)
    return case


def moved_points(case: Case, R: np.ndarray, t: np.ndarray) -> np.ndarray:
    return case.scene.points @ R.T + t


@pytest.mark.kernel
@pytest.mark.parametrize("has_camera", [True, False])
@pytest.mark.parametrize("sigma_mm", [1.0, 2.7, 6.0])
def test_a_coarse_step_is_that_of_the_reference(has_camera: bool, sigma_mm: float) -> None:
    case = case_of(has_camera=has_camera)
    pose, settings = case.pose, settings_of()
    pairs = make_pairs(2000)
    run_coarse_loop(case.scene, case.grid, case.model, pose, pairs, sigma_mm, settings)
    R_expected, t_expected = reference.step_coarse(
        case.scene, case.grid, case.model, case.R, case.t, sigma_mm, settings
    )
    np.testing.assert_allclose(pose.rotation, R_expected, atol=1e-9)
    np.testing.assert_allclose(
        moved_points(case, *pose), moved_points(case, R_expected, t_expected), atol=1e-9
    )
    assert np.abs(moved_points(case, *pose) - moved_points(case, case.R, case.t)).max() > 0.1


@pytest.mark.kernel
@pytest.mark.parametrize("has_camera", [True, False])
@pytest.mark.parametrize("knows_noise", [True, False])
@pytest.mark.parametrize("sigma_mm", [0.5, 2.4])
def test_a_fine_step_is_that_of_the_reference(
    has_camera: bool, knows_noise: bool, sigma_mm: float
) -> None:
    case = make_case(has_camera=has_camera, knows_noise=knows_noise)
    pose, settings = case.pose, settings_of()
    pairs = make_pairs(500)
    state = run_fine_loop(case.scene, case.model, pose, pairs, sigma_mm, settings)
    R_expected, t_expected, wanted_mm = reference.step_fine(
        case.scene, case.model, case.R, case.t, sigma_mm, settings
    )
    np.testing.assert_allclose(pose.rotation, R_expected, atol=1e-9)
    np.testing.assert_allclose(
        moved_points(case, *pose), moved_points(case, R_expected, t_expected), atol=1e-9
    )
    assert state.sigma_mm == pytest.approx(sigma_mm if knows_noise else wanted_mm, rel=1e-9)
    assert (state.iterations, state.has_finished) == (1, False)


@pytest.mark.kernel
def test_the_first_kernel_follows_the_median_distance_within_its_bounds() -> None:
    case, settings, pairs = make_case(), settings_of(), make_pairs(500)
    chosen, vertex = reference.pair_forward(case.scene, case.model, case.R, case.t, 2)
    measured = reference.measure_pairs(case.scene, case.model, case.R, case.t, chosen, vertex)
    median = np.median(np.hypot(measured.residual, measured.excess))
    found = choose_first_sigma_mm(case.scene, case.model, case.pose, pairs, settings)
    assert found == pytest.approx(1.5 * median, rel=1e-9)
    narrow = settings._replace(widest_mm=0.5)
    assert choose_first_sigma_mm(case.scene, case.model, case.pose, pairs, narrow) == 0.5
    wide = settings._replace(narrowest_mm=9.0)
    assert choose_first_sigma_mm(case.scene, case.model, case.pose, pairs, wide) == 9.0


def test_five_pairs_are_too_few_for_every_loop() -> None:
    case, settings = case_of(has_camera=False), settings_of(9)
    case.scene = case.scene._replace(points=case.scene.points[:10:2].copy())
    pose, pairs = case.pose, make_pairs(2000)
    assert choose_first_sigma_mm(case.scene, case.model, pose, pairs, settings) == 0.0
    far = run_coarse_loop(case.scene, case.grid, case.model, pose, pairs, 2.0, settings)
    rest = run_fine_loop(case.scene, case.model, pose, pairs, 2.0, settings)
    for state in (far, rest):
        assert (state.iterations, state.has_finished, state.sigma_mm) == (1, False, 0.0)
    np.testing.assert_array_equal(pose.rotation, case.R)
    np.testing.assert_array_equal(pose.translation, case.t)


def test_the_coarse_loop_narrows_the_kernel_to_the_noise_and_the_fine_one_converges() -> None:
    case, settings = case_of(has_camera=False), settings_of(60)
    pose, pairs = case.pose, make_pairs(2000)
    far = run_coarse_loop(case.scene, case.grid, case.model, pose, pairs, 6.0, settings)
    assert far.has_finished
    assert 1.0 < far.sigma_mm <= 3.0
    rest = run_fine_loop(case.scene, case.model, pose, pairs, far.sigma_mm, settings)
    assert rest.has_finished
    # 0.8 mm of noise, and a kernel of two and a half times that.
    assert rest.sigma_mm == pytest.approx(2.5 * 0.8, rel=0.1)
    before = pose.rotation.copy(), pose.translation.copy()
    again = run_fine_loop(case.scene, case.model, pose, pairs, rest.sigma_mm, settings)
    assert again.iterations <= 5
    np.testing.assert_allclose(moved_points(case, *pose), moved_points(case, *before), atol=0.03)


def test_a_known_noise_narrows_the_kernel_all_the_way() -> None:
    case, settings = case_of(has_camera=False, knows_noise=True), settings_of(60)
    pose, pairs = case.pose, make_pairs(2000)
    far = run_coarse_loop(case.scene, case.grid, case.model, pose, pairs, 6.0, settings)
    assert far.has_finished
    assert far.sigma_mm == 0.3
