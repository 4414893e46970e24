from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.registration import RegistrationModel, Scene, fit_bimcc
from navapp.registration.cartilage_fit import KernelWidth, ThicknessField, ThicknessFit
from navapp.registration.information import compute_information
from navapp.registration.pairing_kernels import Pose
from navapp.registration.step_kernels import find_motion_rows, find_weighted_centre
from navapp.tracking.frame import MODEL_SETTINGS
from navapp.values import BoneModel, Reason
from sim_devices.relief import make_waves
from tests.registration.kernel_cases import POSE, make_case, measured_pairs
from tests.registration.shapes import TRUE, ball_mesh, femur, seen_vertices

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


def drawn_field(n_vertices: int, n_unknowns: int = 5) -> ThicknessField:
    basis_mm = np.random.default_rng(3).normal(0.0, 0.3, (n_vertices, n_unknowns))
    return ThicknessField(basis_mm, (basis_mm**2).sum(axis=1))


@pytest.mark.kernel
@pytest.mark.parametrize("counts_thickness", [False, True])
def test_a_step_is_that_of_one_large_least_squares(counts_thickness: bool) -> None:
    """Residuals r + J m - B t in their weights, and t itself, brought down at once.

    The second step begins with a thickness that is not 0.
    """
    pairs, n, _, _ = measured_pairs(make_case())
    measured_mm, variance_mm2 = pairs.residual[:n].copy(), pairs.variance[:n].copy()
    field = drawn_field(int(pairs.vertex.max()) + 1)
    rows_mm = field.basis_mm[pairs.vertex[:n]]
    claimed_mm2 = field.variance_mm2[pairs.vertex[:n]]
    variance_mm2 += claimed_mm2
    fit, sharing = ThicknessFit(field, pairs, n), 4.0
    kernel = KernelWidth(0.5, 1.2, counts_thickness)
    for _ in range(2):
        left_mm = measured_mm - rows_mm @ fit.unknowns
        pairs.residual[:n], pairs.variance[:n] = measured_mm, variance_mm2
        noise_mm2 = variance_mm2 - (0.0 if counts_thickness else claimed_mm2)
        rho2 = left_mm**2 + pairs.excess[:n] ** 2
        width2 = np.maximum(0.5**2, 1.2**2 * noise_mm2)
        weight = np.exp(-0.5 * rho2 / width2) / (variance_mm2 - claimed_mm2)
        pose = Pose(np.eye(3), np.zeros(3))
        turn_rad, shift_mm = fit.step(pairs, n, kernel, sharing, pose)
        # Kernels of next to nothing are left out.
        np.testing.assert_allclose(pairs.weight[:n], weight, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(pairs.residual[:n], left_mm, atol=1e-12)
        np.testing.assert_allclose(pairs.variance[:n], variance_mm2 - claimed_mm2)
        centre, lever_mm = find_weighted_centre(pairs, n)
        root = np.sqrt(weight)[:, None]
        rows = np.hstack([find_motion_rows(pairs, n, centre, lever_mm), -rows_mm]) * root
        known = np.hstack([np.zeros((5, 6)), np.sqrt(sharing) * np.eye(5)])
        expected = np.linalg.lstsq(
            np.vstack([rows, known]), -np.append(root[:, 0] * measured_mm, np.zeros(5)), rcond=None
        )[0]
        np.testing.assert_allclose(fit.unknowns, expected[6:], rtol=1e-7, atol=1e-9)
        turn = expected[:3] / lever_mm
        assert turn_rad == pytest.approx(np.linalg.norm(turn))
        assert shift_mm == pytest.approx(np.linalg.norm(expected[3:6]))
        np.testing.assert_allclose(pose.rotation, rotation_from_vector(turn), atol=1e-9)
        np.testing.assert_allclose(
            pose.translation, centre - pose.rotation @ centre + expected[3:6], atol=1e-9
        )
    assert np.linalg.norm(fit.unknowns) > 0.1


def test_where_no_cartilage_is_seen_nothing_of_it_is_fitted() -> None:
    bone = femur()
    vertices_mm = bone.mesh.vertices_mm
    apart_mm, _ = cKDTree(vertices_mm[seen_vertices(bone)]).query(vertices_mm)
    sd_mm = np.where(apart_mm > 6.0, SD_MM, 0.0)
    assert sd_mm.any()
    scene = seen_scene(-2.0, tells_shape=True)
    found = fit_bimcc(scene, RegistrationModel(replace(bone, cartilage_sd_mm=sd_mm)), TRUE)
    plain = fit_bimcc(scene, RegistrationModel(bone), TRUE)
    assert found.thickness_ratio is None
    np.testing.assert_array_equal(found.covariance, plain.covariance)


def test_a_covered_ball_is_still_free_to_turn() -> None:
    mesh = ball_mesh(25.0)
    n = len(mesh.vertices_mm)
    covered = BoneModel("femur", mesh, cartilage_sd_mm=np.full(n, SD_MM))
    points_mm = mesh.vertices_mm[mesh.vertices_mm[:, 2] < 0.0]
    pose = RigidTransform.from_parts("left_rect", "femur", np.eye(3), (0.0, 0.0, 400.0))
    scene = Scene(
        pose.apply(points_mm), np.zeros(3), np.full(len(points_mm), 0.1), tells_shape=True
    )
    for bone in (covered, BoneModel("femur", mesh)):
        assert Reason.DEGENERATE in fit_bimcc(scene, RegistrationModel(bone), pose).reasons


def test_the_covariance_is_that_of_pose_and_thickness_together() -> None:
    pairs, n, _, _ = measured_pairs(make_case())
    pairs.weight[:n] = 4.0
    centre, lever_mm = find_weighted_centre(pairs, n)
    rows = find_motion_rows(pairs, n, centre, lever_mm)
    # One of them looks like a shift, which it makes unsure and not free.
    rows_mm, sharing = np.random.default_rng(4).normal(0.0, 0.3, (n, 5)), 4.0
    rows_mm[:, 0] += 10.0 * rows[:, 5]
    found, plain = (
        compute_information(pairs, n, POSE, CENTRE, sharing, tells_size=True, thickness_rows_mm=one)
        for one in (rows_mm, None)
    )
    assert not found.is_degenerate
    noise_mm2 = np.eye(n) * sharing / 4.0 + rows_mm @ rows_mm.T
    offsets_mm = (pairs.point[:n] - centre) / lever_mm
    sized_rows = np.column_stack([rows, -(offsets_mm * pairs.direction[:n]).sum(axis=1)])
    known = np.diag([0.0] * 6 + [1.0 / (0.05 * lever_mm) ** 2])
    # In whatever coordinates: by so much the variances grow.
    for of, all_rows, before in (
        (lambda one: one.covariance, rows, np.zeros((6, 6))),
        (lambda one: one.sized.covariance, sized_rows, known),
    ):
        of_noise = np.linalg.inv(all_rows.T @ all_rows * 4.0 / sharing + before)
        together = np.linalg.inv(all_rows.T @ np.linalg.inv(noise_mm2) @ all_rows + before)
        growth, expected = (
            np.sort(np.linalg.eigvals(np.linalg.solve(one, other)).real)
            for one, other in ((of(plain), of(found)), (of_noise, together))
        )
        np.testing.assert_allclose(growth, expected, rtol=1e-4)
        assert growth[-1] > 2.0


@pytest.mark.parametrize("thicker_mm", [-0.4, 0.4])
def test_cartilage_that_is_thicker_everywhere_no_longer_moves_the_pose(thicker_mm: float) -> None:
    model = RegistrationModel(covered_femur())
    blind = fit_bimcc(seen_scene(thicker_mm, tells_shape=False), model, TRUE, MODEL_SETTINGS)
    found = fit_bimcc(seen_scene(thicker_mm, tells_shape=True), model, TRUE, MODEL_SETTINGS)
    assert error_mm(found) < 0.4 * error_mm(blind)
    assert blind.thickness_ratio is None
    assert found.thickness_ratio == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize(("wave_mm", "gain"), [(25.0, 1.5), (50.0, 1.1), (90.0, 0.3)])
def test_the_bound_covers_what_smooth_errors_of_the_thickness_cost(
    wave_mm: float, gain: float
) -> None:
    """Errors of other lengths than the field's own; the sides of the bone are bare."""
    bone = covered_femur()
    sd_mm = np.where(np.abs(bone.mesh.normals[:, 0]) < 0.7, SD_MM, 0.0)
    model = RegistrationModel(replace(bone, cartilage_sd_mm=sd_mm))
    targets_mm = bone.mesh.vertices_mm[seen_vertices(femur())]
    held, errors_mm, blind_mm, bounds_mm = [], [], [], []
    for seed in range(12):
        waves = make_waves(np.random.default_rng(seed), SD_MM, (0.7 * wave_mm, 1.3 * wave_mm))
        thicker_mm = np.where(sd_mm > 0.0, waves(bone.mesh.vertices_mm), 0.0)
        # Neighbours share their errors as those of pictures do.
        scene = replace(seen_scene(thicker_mm, tells_shape=True), n_sharing_errors=13.0)
        found = fit_bimcc(scene, model, TRUE, MODEL_SETTINGS)
        blind = fit_bimcc(replace(scene, tells_shape=False), model, TRUE, MODEL_SETTINGS)
        for told, one in ((errors_mm, found), (blind_mm, blind)):
            shift_mm = one.camera_from_bone.apply(targets_mm) - TRUE.apply(targets_mm)
            told.append(float(np.linalg.norm(shift_mm, axis=1).mean()))
        bounds_mm.append(found.predict_tre_mm(model.centre_mm, targets_mm))
        held.append(errors_mm[-1] <= bounds_mm[-1])
    assert sum(held) >= 11
    # Of a bone that is seen from all around, short waves move the pose little in any case.
    assert np.median(errors_mm) < gain * np.median(blind_mm)
    assert np.median(bounds_mm) < 6.0 * np.median(errors_mm)


def test_cartilage_as_planned_costs_little() -> None:
    found = fit_bimcc(seen_scene(0.0, tells_shape=True), RegistrationModel(covered_femur()), TRUE)
    assert error_mm(found) < 0.05
    assert found.thickness_ratio < 0.1
