import numpy as np
import pytest

from navapp.registration.bimcc_kernels import (
    LoopSettings,
    first_sigma_mm,
    loop_from_far,
    loop_to_rest,
)
from navapp.registration.pairing_kernels import make_pairs
from tests.reference import bimcc_reference as reference
from tests.registration.kernel_cases import Case, make_case


def loop_settings(*, knows_noise: bool = False, max_iterations: int = 1) -> LoopSettings:
    return LoopSettings(
        widest_mm=12.0,
        narrowest_mm=0.3,
        n_sigmas=2.5,
        widest_at_rest_mm=2.5,
        knows_noise=knows_noise,
        backward_weight=1.5,
        point_weight=0.1,
        scene_every=2,
        model_every=2,
        max_iterations=max_iterations,
        settled_rad=2e-5,
        settled_mm=2e-3,
    )


def moved_points(case: Case, R: np.ndarray, t: np.ndarray) -> np.ndarray:
    return case.scene.points @ R.T + t


@pytest.mark.parametrize("has_camera", [True, False])
@pytest.mark.parametrize("sigma_mm", [1.0, 2.7, 6.0])
def test_a_step_from_far_is_that_of_the_reference(has_camera: bool, sigma_mm: float) -> None:
    case = make_case(has_camera=has_camera)
    R, t, settings = case.R.copy(), case.t.copy(), loop_settings()
    pairs = make_pairs(2000)
    state = loop_from_far(case.scene, case.grid, case.model, R, t, pairs, sigma_mm, settings)
    R_expected, t_expected, J = reference.step_from_far(
        case.scene, case.grid, case.model, case.R, case.t, sigma_mm, settings
    )
    np.testing.assert_allclose(R, R_expected, atol=1e-9)
    np.testing.assert_allclose(
        moved_points(case, R, t), moved_points(case, R_expected, t_expected), atol=1e-9
    )
    assert state.objective == pytest.approx(J, rel=1e-9)
    assert np.abs(moved_points(case, R, t) - moved_points(case, case.R, case.t)).max() > 0.1


@pytest.mark.parametrize("has_camera", [True, False])
@pytest.mark.parametrize("knows_noise", [True, False])
@pytest.mark.parametrize("sigma_mm", [0.5, 2.4])
def test_a_step_to_rest_is_that_of_the_reference(
    has_camera: bool, knows_noise: bool, sigma_mm: float
) -> None:
    case = make_case(has_camera=has_camera, knows_noise=knows_noise)
    R, t, settings = case.R.copy(), case.t.copy(), loop_settings(knows_noise=knows_noise)
    pairs = make_pairs(500)
    state = loop_to_rest(case.scene, case.model, R, t, pairs, sigma_mm, settings)
    R_expected, t_expected, J, wanted_mm = reference.step_to_rest(
        case.scene, case.model, case.R, case.t, sigma_mm, settings
    )
    np.testing.assert_allclose(R, R_expected, atol=1e-9)
    np.testing.assert_allclose(
        moved_points(case, R, t), moved_points(case, R_expected, t_expected), atol=1e-9
    )
    assert state.objective == pytest.approx(J, rel=1e-9)
    assert state.sigma_mm == pytest.approx(sigma_mm if knows_noise else wanted_mm, rel=1e-9)
    assert (state.iterations, state.has_finished) == (1, False)


def test_the_first_kernel_follows_the_median_distance_within_its_bounds() -> None:
    case, settings, pairs = make_case(), loop_settings(), make_pairs(500)
    chosen, vertex = reference.pair_forward(case.scene, case.model, case.R, case.t, 2)
    measured = reference.measure_pairs(case.scene, case.model, case.R, case.t, chosen, vertex)
    median = np.median(np.hypot(measured.residual, measured.excess))
    found = first_sigma_mm(case.scene, case.model, case.R, case.t, pairs, settings)
    assert found == pytest.approx(1.5 * median, rel=1e-9)
    narrow = settings._replace(widest_mm=0.5)
    assert first_sigma_mm(case.scene, case.model, case.R, case.t, pairs, narrow) == 0.5
    wide = settings._replace(narrowest_mm=9.0)
    assert first_sigma_mm(case.scene, case.model, case.R, case.t, pairs, wide) == 9.0


def test_five_pairs_are_too_few_for_every_loop() -> None:
    case, settings = make_case(has_camera=False), loop_settings(max_iterations=9)
    case.scene = case.scene._replace(points=case.scene.points[:10:2].copy())
    R, t, pairs = case.R.copy(), case.t.copy(), make_pairs(2000)
    assert first_sigma_mm(case.scene, case.model, R, t, pairs, settings) == 0.0
    far = loop_from_far(case.scene, case.grid, case.model, R, t, pairs, 2.0, settings)
    rest = loop_to_rest(case.scene, case.model, R, t, pairs, 2.0, settings)
    for state in (far, rest):
        assert (state.iterations, state.has_finished, state.sigma_mm) == (1, False, 0.0)
    np.testing.assert_array_equal(R, case.R)
    np.testing.assert_array_equal(t, case.t)


def test_from_far_the_kernel_narrows_to_the_noise_and_at_rest_the_pose_settles() -> None:
    case, settings = make_case(has_camera=False), loop_settings(max_iterations=60)
    R, t, pairs = case.R.copy(), case.t.copy(), make_pairs(2000)
    far = loop_from_far(case.scene, case.grid, case.model, R, t, pairs, 6.0, settings)
    assert far.has_finished
    assert 1.0 < far.sigma_mm <= 3.0
    rest = loop_to_rest(case.scene, case.model, R, t, pairs, far.sigma_mm, settings)
    assert rest.has_finished
    # 0.8 mm of noise, and a kernel of two and a half times that.
    assert rest.sigma_mm == pytest.approx(2.5 * 0.8, rel=0.1)
    before = R.copy(), t.copy()
    again = loop_to_rest(case.scene, case.model, R, t, pairs, rest.sigma_mm, settings)
    assert again.iterations <= 5
    np.testing.assert_allclose(moved_points(case, R, t), moved_points(case, *before), atol=0.03)


def test_a_known_noise_narrows_the_kernel_all_the_way() -> None:
    case = make_case(has_camera=False)
    settings = loop_settings(knows_noise=True, max_iterations=60)
    R, t, pairs = case.R.copy(), case.t.copy(), make_pairs(2000)
    far = loop_from_far(case.scene, case.grid, case.model, R, t, pairs, 6.0, settings)
    assert far.has_finished
    assert far.sigma_mm == 0.3
