from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import rotation_from_vector
from navapp.registration import RegistrationModel, Scene, fit_bimcc
from navapp.registration.information import compute_information
from navapp.registration.pairing_kernels import Pose
from navapp.registration.step_kernels import find_motion_rows, find_weighted_centre
from navapp.registration.thickness import ThicknessField, ThicknessFit
from tests.registration.kernel_cases import POSE, make_case, measured_pairs
from tests.registration.shapes import TRUE, femur, seen_vertices

SD_MM = 0.4
CENTRE = np.array([4.0, -3.0, 8.0])


def covered_femur(planned_mm=2.0, sd_mm: float = SD_MM):
    n = len(femur().mesh.vertices_mm)
    return replace(femur(), cartilage_mm=np.full(n, planned_mm), cartilage_sd_mm=np.full(n, sd_mm))


def seen_scene(thicker_mm: np.ndarray | float, *, tells_shape: bool) -> Scene:
    """Points of cartilage that is 2 mm and so much more, (V,), thick."""
    bone = femur()
    out_mm = np.broadcast_to(2.0 + thicker_mm, len(bone.mesh.vertices_mm))[:, None]
    points_mm = (bone.mesh.vertices_mm + out_mm * bone.mesh.normals)[seen_vertices(bone)[::4]]
    sigma_mm = np.full(len(points_mm), 0.1)
    return Scene(TRUE.apply(points_mm), np.zeros(3), sigma_mm, tells_shape=tells_shape)


def error_mm(estimate) -> float:
    """Of the model's vertices, rms."""
    points_mm = femur().mesh.vertices_mm
    apart_mm = estimate.camera_from_bone.apply(points_mm) - TRUE.apply(points_mm)
    return float(np.sqrt((apart_mm**2).sum(axis=1).mean()))


def test_a_thickness_that_is_known_has_no_field() -> None:
    points_mm = femur().mesh.vertices_mm
    assert ThicknessField.over(points_mm, np.zeros(len(points_mm))) is None
    assert RegistrationModel(femur()).thickness is None


def test_the_field_has_the_deviation_of_the_plan_and_goes_together_over_centimetres() -> None:
    points_mm = femur().mesh.vertices_mm[::7]
    sd_mm = np.where(points_mm[:, 2] < 0.0, SD_MM, 0.0)
    basis_mm = ThicknessField.over(points_mm, sd_mm).basis_mm
    np.testing.assert_allclose(np.sqrt((basis_mm**2).sum(axis=1)), sd_mm, atol=1e-12)
    covered = np.flatnonzero(sd_mm)
    correlation = basis_mm[covered] @ basis_mm[covered].T / SD_MM**2
    apart_mm = np.linalg.norm(points_mm[covered, None] - points_mm[covered], axis=2)
    claimed = 0.3 + 0.7 * np.exp(-0.5 * (apart_mm / 15.0) ** 2)
    assert np.abs(correlation - claimed).max() < 0.25
    assert np.abs(correlation - claimed).mean() < 0.05


def test_a_step_is_that_of_one_large_least_squares() -> None:
    """Residuals r + J m - B t in their weights, and t itself, brought down at once."""
    pairs, n, _, _ = measured_pairs(make_case())
    rng = np.random.default_rng(3)
    pairs.weight[:n] = rng.uniform(1.0, 9.0, n)
    field = ThicknessField(
        rng.normal(0.0, 0.3, (int(pairs.vertex.max()) + 1, 5)), np.full(9999, 0.1)
    )
    fit = ThicknessFit(field, pairs, n)
    residual_mm, sharing = fit.take_out(pairs, n), 4.0
    centre, lever_mm = find_weighted_centre(pairs, n)
    root = np.sqrt(pairs.weight[:n])[:, None]
    rows = np.hstack([find_motion_rows(pairs, n, centre, lever_mm), -fit.rows_mm]) * root
    known = np.hstack([np.zeros((5, 6)), np.sqrt(sharing) * np.eye(5)])
    expected = np.linalg.lstsq(
        np.vstack([rows, known]), -np.append(root[:, 0] * residual_mm, np.zeros(5)), rcond=None
    )[0]
    pose = Pose(np.eye(3), np.zeros(3))
    turn_rad, shift_mm = fit.step(pairs, n, residual_mm, sharing, pose)
    np.testing.assert_allclose(fit.unknowns, expected[6:], rtol=1e-8, atol=1e-10)
    turn = expected[:3] / lever_mm
    assert turn_rad == pytest.approx(np.linalg.norm(turn))
    assert shift_mm == pytest.approx(np.linalg.norm(expected[3:6]))
    np.testing.assert_allclose(pose.rotation, rotation_from_vector(turn), atol=1e-9)
    np.testing.assert_allclose(
        pose.translation, centre - pose.rotation @ centre + expected[3:6], atol=1e-9
    )


def test_the_covariance_is_that_of_pose_and_thickness_together() -> None:
    pairs, n, _, _ = measured_pairs(make_case())
    pairs.weight[:n] = 4.0
    centre, lever_mm = find_weighted_centre(pairs, n)
    rows = find_motion_rows(pairs, n, centre, lever_mm)
    # One of them looks like a shift.
    rows_mm, sharing = np.random.default_rng(4).normal(0.0, 0.3, (n, 5)), 4.0
    rows_mm[:, 0] += rows[:, 5]
    found = compute_information(pairs, n, POSE, CENTRE, sharing, thickness_rows_mm=rows_mm)
    plain = compute_information(pairs, n, POSE, CENTRE, sharing)
    noise_mm2 = np.eye(n) * sharing / 4.0 + rows_mm @ rows_mm.T
    # In whatever coordinates: by so much the variances grow.
    of_motion = sharing / 4.0 * np.linalg.inv(rows.T @ rows)
    together = np.linalg.inv(rows.T @ np.linalg.inv(noise_mm2) @ rows)
    growth, expected = (
        np.sort(np.linalg.eigvals(np.linalg.solve(one, other)).real)
        for one, other in ((plain.covariance, found.covariance), (of_motion, together))
    )
    np.testing.assert_allclose(growth, expected, rtol=1e-5)
    assert growth[-1] > 2.0


@pytest.mark.parametrize("thicker_mm", [-0.4, 0.4])
def test_cartilage_that_is_thicker_everywhere_no_longer_moves_the_pose(thicker_mm: float) -> None:
    model = RegistrationModel(covered_femur())
    blind = fit_bimcc(seen_scene(thicker_mm, tells_shape=False), model, TRUE)
    found = fit_bimcc(seen_scene(thicker_mm, tells_shape=True), model, TRUE)
    assert error_mm(found) < 0.4 * error_mm(blind)
    assert blind.thickness_ratio is None
    assert found.thickness_ratio == pytest.approx(1.0, abs=0.3)


def test_the_bound_covers_what_a_smooth_error_of_the_thickness_costs() -> None:
    bone = covered_femur()
    model = RegistrationModel(bone)
    targets_mm = bone.mesh.vertices_mm[seen_vertices(femur())]
    basis_mm = model.thickness.basis_mm
    held, errors_mm, blind_mm = [], [], []
    for seed in range(12):
        drawn = np.random.default_rng(seed).normal(size=basis_mm.shape[1])
        scene = seen_scene(basis_mm @ drawn, tells_shape=True)
        found = fit_bimcc(scene, model, TRUE)
        shift_mm = found.camera_from_bone.apply(targets_mm) - TRUE.apply(targets_mm)
        errors_mm.append(float(np.linalg.norm(shift_mm, axis=1).mean()))
        held.append(errors_mm[-1] <= found.predict_tre_mm(model.centre_mm, targets_mm))
        blind_mm.append(error_mm(fit_bimcc(replace(scene, tells_shape=False), model, TRUE)))
    assert np.mean(held) >= 0.8
    assert np.median(errors_mm) < 0.6 * np.median(blind_mm)


def test_cartilage_as_planned_costs_little() -> None:
    found = fit_bimcc(seen_scene(0.0, tells_shape=True), RegistrationModel(covered_femur()), TRUE)
    assert error_mm(found) < 0.05
    assert found.thickness_ratio < 0.1
