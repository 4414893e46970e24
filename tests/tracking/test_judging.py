"""What is said of poses of which the truth is known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from navapp.geometry.rig import RigQuality
from navapp.registration import RegistrationModel, fit_bimcc, solution_at
from navapp.registration.verdict import OK_ERROR_MM
from navapp.tracking import Goal, TrackerSettings
from navapp.tracking.agreement import compare
from navapp.tracking.frame import FREE_SETTINGS, NOISE_VARIANCE_RATIO, Fit
from navapp.tracking.judging import PoseJudge
from navapp.values import (
    BoneModel,
    DisparityMap,
    Origin,
    PoseEstimate,
    Reason,
    SizedPose,
    Status,
    Stopwatch,
    Verdict,
)
from sim_devices.anatomy import KneeSpec, make_knee
from tests.registration.shapes import GEOMETRY, TRUE, disturbed
from tests.tracking.judged import BONE, MAP, MODEL, NO_TARGETS, judged, meter_of, scene_of
from tests.tracking.rooms import measured_map


def estimate_on(measured: DisparityMap = MAP, model=MODEL, pose=TRUE) -> PoseEstimate:
    return solution_at(scene_of(measured), model, pose, FREE_SETTINGS).estimate


def verdict_on(
    pose=TRUE, measured: DisparityMap = MAP, model=MODEL, is_accepted: bool = True,
    tolerance_mm: float = 3.0, predicted=None,
) -> Verdict:  # fmt: skip
    goal, quality = Goal(NO_TARGETS, tolerance_mm), RigQuality(is_accepted)
    estimate = estimate_on(measured, model, pose)
    return judged(
        estimate, measured, goal, model=model, quality=quality, predicted=predicted
    ).verdict


def test_the_truth_is_ok() -> None:
    verdict = verdict_on()
    assert verdict.status is Status.OK
    assert verdict.reasons == ()
    assert verdict.coverage > 0.9
    assert verdict.inlier_fraction > 0.9
    assert verdict.occluded_fraction < 0.01
    assert 0.0 < verdict.predicted_tre_mm < 3.0


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_pose_turned_by_fifteen_degrees_is_lost(axis: int, sign: float) -> None:
    twist = np.zeros(6)
    twist[3 + axis] = sign * np.radians(15.0)
    wrong = TRUE.move(twist, TRUE.apply(MODEL.centre_mm))
    assert verdict_on(wrong).status is Status.LOST


@pytest.mark.parametrize("spec", [KneeSpec(1, "left"), KneeSpec(1, sex="male")])
def test_a_femur_of_another_kind_is_not_ok_however_well_it_is_fitted(spec: KneeSpec) -> None:
    """The other side's, and one of another size."""
    mesh = make_knee(spec).bones["femur"]
    other = RegistrationModel(BoneModel("femur", mesh, spec.side))
    fitted = fit_bimcc(scene_of(MAP), other, TRUE, FREE_SETTINGS)
    verdict = verdict_on(fitted.camera_from_bone, model=other)
    assert verdict.status is not Status.OK
    assert {Reason.SURFACE_MISFIT, Reason.OUTLIERS} & set(verdict.reasons)


def test_another_bone_is_lost() -> None:
    mesh = make_knee(KneeSpec(1)).bones["tibia"]
    other = RegistrationModel(BoneModel("femur", mesh, "right"))
    fitted = fit_bimcc(scene_of(MAP), other, TRUE, FREE_SETTINGS)
    assert verdict_on(fitted.camera_from_bone, model=other).status is Status.LOST


def with_blob(share: float) -> DisparityMap:
    """Something 40 mm nearer stands before the upper part of the bone."""
    measured = MAP.disparity_px.copy()
    rows = round(share * measured.shape[0])
    nearer = GEOMETRY.disparity_px(float(TRUE.translation_mm[2]) - 90.0)
    measured[-rows:] = nearer
    origin = MAP.origin.copy()
    origin[-rows:] = Origin.MATCHED
    sigma = MAP.sigma_px.copy()
    sigma[-rows:] = 0.25
    return DisparityMap(measured, sigma, origin, MAP.x, MAP.y)


def test_a_small_occluder_is_named_and_does_not_count_as_a_misfit() -> None:
    verdict = verdict_on(measured=with_blob(0.2))
    assert verdict.status is Status.OK
    assert verdict.occluded_fraction > 0.1
    assert verdict.inlier_fraction > 0.9
    assert verdict.coverage < verdict_on().coverage


def test_a_large_occluder_leaves_too_little_of_the_bone() -> None:
    verdict = verdict_on(measured=with_blob(0.68))
    assert verdict.status is not Status.OK
    assert Reason.COVERAGE_LOW in verdict.reasons
    assert verdict.occluded_fraction > 0.5


def test_filled_pixels_do_not_count_as_seen() -> None:
    filled = replace(MAP, origin=np.where(MAP.origin == 1, Origin.FILLED_INTERIOR, 0))
    found = compare(MODEL.render(TRUE, GEOMETRY, MAP.box), MODEL, filled, GEOMETRY)
    assert found.coverage == 0.0


def test_a_rig_that_was_not_accepted_is_degraded_at_best() -> None:
    verdict = verdict_on(is_accepted=False)
    assert verdict.status is Status.DEGRADED
    assert verdict.reasons == (Reason.RIG_NOT_ACCEPTED,)


def test_a_rig_that_was_not_accepted_is_told_of_lost_poses_too() -> None:
    wrong = TRUE.move((0.0, 0.0, 0.0, 0.0, 0.0, np.radians(15.0)), TRUE.apply(MODEL.centre_mm))
    lost, given = verdict_on(wrong), verdict_on(wrong, is_accepted=False)
    assert lost.status is given.status is Status.LOST
    assert set(given.reasons) == {*lost.reasons, Reason.RIG_NOT_ACCEPTED}
    loose = replace(estimate_on(), covariance=np.full((6, 6), np.inf))
    told = judged(loose, quality=RigQuality(False, ("too few pictures",))).verdict
    assert told.reasons == (Reason.DEGENERATE, Reason.RIG_NOT_ACCEPTED)
    meter = meter_of(MODEL, RigQuality(False, ("too few pictures",)))
    judge = PoseJudge(meter, TrackerSettings())
    nothing = judge.lost(Reason.OUT_OF_VIEW, Stopwatch()).verdict
    assert nothing.reasons == (Reason.OUT_OF_VIEW, Reason.RIG_NOT_ACCEPTED)


def test_the_bound_is_held_against_the_stages_tolerance() -> None:
    bound = verdict_on().predicted_tre_mm
    assert verdict_on(tolerance_mm=bound * 1.01).status is Status.OK
    verdict = verdict_on(tolerance_mm=bound * 0.99)
    assert verdict.status is Status.DEGRADED
    assert verdict.reasons == (Reason.TRE_TOO_LARGE,)


def test_a_view_that_fixes_the_pose_too_loosely_is_degraded_whatever_the_tolerance() -> None:
    """Enough of the bone agrees, but the part that is seen leaves more than is promised."""
    measured = with_blob(0.35)
    verdict = verdict_on(measured=measured, tolerance_mm=99.0)
    assert verdict.status is Status.DEGRADED
    assert verdict.reasons == (Reason.POSE_UNCERTAIN,)
    assert verdict.predicted_tre_mm > OK_ERROR_MM
    goal = Goal(NO_TARGETS, 99.0, seen_limit_mm=1.01 * verdict.predicted_tre_mm)
    assert judged(estimate_on(measured), measured, goal).verdict.status is Status.OK


def bound_mm(targets_mm: np.ndarray) -> float:
    return judged(estimate_on(), goal=Goal(targets_mm, 9.0)).verdict.predicted_tre_mm


def test_without_targets_the_bound_is_that_of_what_is_seen() -> None:
    is_seen = MODEL.bone.mesh.visible_vertices(TRUE)
    vertices_mm = MODEL.bone.mesh.vertices_mm
    bounds = [
        bound_mm(targets_mm)
        for targets_mm in (NO_TARGETS, vertices_mm[is_seen], vertices_mm[~is_seen])
    ]
    assert bounds[0] == bounds[1]
    assert abs(bounds[2] - bounds[0]) > 0.05 * bounds[0]


def test_of_many_targets_some_stand_for_all() -> None:
    targets_mm = MODEL.bone.mesh.vertices_mm
    step = len(targets_mm) // 200
    assert step > 1
    assert bound_mm(targets_mm) == bound_mm(targets_mm[::step])
    # Of fewer than twice as many every one counts.
    few_mm, centre_mm = targets_mm[:250], MODEL.centre_mm
    assert bound_mm(few_mm) == pytest.approx(estimate_on().predict_tre_mm(centre_mm, few_mm))


def test_what_the_calibration_leaves_widens_the_bound_and_nothing_else() -> None:
    estimate = estimate_on()
    exact, known = (
        judged(estimate, quality=quality).verdict for quality in (None, RigQuality(True, (), 0.3))
    )
    assert known.predicted_tre_mm == pytest.approx(np.hypot(exact.predicted_tre_mm, 0.3))
    assert (known.status, known.reasons) == (exact.status, exact.reasons)


def test_the_calibrations_error_grows_beyond_its_working_volume() -> None:
    quality = RigQuality(True, (), 0.2, figures={"working_far_mm": 500.0})
    assert quality.error_mm(400.0) == quality.error_mm(500.0) == 0.2
    assert quality.error_mm(700.0) == pytest.approx(0.2 * 1.4**2)


def test_what_the_plans_cartilage_costs_is_not_held_against_the_view() -> None:
    """The deviation of the thickness widens what is promised as it widens what is predicted."""
    sd_mm = np.full(len(BONE.mesh.vertices_mm), 0.35)
    model = RegistrationModel(replace(BONE, cartilage_sd_mm=sd_mm))
    verdict = verdict_on(model=model)
    assert verdict.status is Status.OK
    assert verdict.predicted_tre_mm > 2.0 * 0.35


def test_what_the_plans_surface_may_be_off_is_in_the_bound() -> None:
    model = RegistrationModel(replace(BONE, surface_sd_mm=0.2))
    known, plain = (verdict_on(model=one).predicted_tre_mm for one in (model, MODEL))
    assert known == pytest.approx(np.hypot(plain, 2.0 * 0.2))


def test_a_thickness_that_was_fitted_is_in_the_covariance_and_is_not_added_again() -> None:
    sd_mm = np.full(len(BONE.mesh.vertices_mm), 0.35)
    model = RegistrationModel(replace(BONE, cartilage_sd_mm=sd_mm))
    estimate = replace(estimate_on(model=model), thickness_ratio=0.5)
    bounds_mm = [
        judged(one, model=model).verdict.predicted_tre_mm
        for one in (estimate, replace(estimate, thickness_ratio=None))
    ]
    assert bounds_mm[0] < bounds_mm[1]
    assert np.sqrt(bounds_mm[1] ** 2 - bounds_mm[0] ** 2) == pytest.approx(2.0 * 0.35, rel=0.02)


@pytest.mark.parametrize("thickness_ratio", [None, 0.5])
def test_of_a_covariance_with_the_plans_part_nothing_is_left_out(thickness_ratio) -> None:
    judge = PoseJudge(meter_of(MODEL, None), TrackerSettings())
    fit = Fit(replace(estimate_on(), thickness_ratio=thickness_ratio), None)
    for lies_open in (False, True):
        agreement = SimpleNamespace(lies_open=lies_open)
        is_noise = lies_open and thickness_ratio is None
        expected = NOISE_VARIANCE_RATIO if is_noise else 1.0
        assert judge._noise_variance_ratio(fit, agreement) == expected


def judged_with_size(size_mm: float, sigma_mm: float, model=MODEL, thickness_ratio=None) -> Verdict:
    step = np.append(np.zeros(6), size_mm)
    covariance = np.diag([*[1e-4] * 6, sigma_mm**2])
    sized = SizedPose(step, covariance, np.zeros(3), lever_mm=20.0)
    estimate = replace(estimate_on(model=model), sized=sized, thickness_ratio=thickness_ratio)
    return judged(estimate, model=model).verdict


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_bone_of_another_size_is_doubted_when_that_is_sure_and_costs_much(sign: float) -> None:
    assert Reason.SIZE_DIFFERS in judged_with_size(sign * 0.6, 0.1).reasons
    assert judged_with_size(sign * 0.6, 0.1).status is Status.DEGRADED
    assert Reason.SIZE_DIFFERS not in judged_with_size(sign * 0.4, 0.1).reasons
    assert Reason.SIZE_DIFFERS not in judged_with_size(sign * 0.6, 0.25).reasons


def test_what_a_seen_size_costs_is_in_the_bound_however_sure_it_is() -> None:
    bounds = [judged_with_size(0.2, sigma_mm).predicted_tre_mm for sigma_mm in (0.01, 0.25)]
    assert bounds[0] == bounds[1] > judged_with_size(0.0, 0.25).predicted_tre_mm


def test_a_bone_of_which_no_size_is_seen_is_not_doubted_for_it() -> None:
    assert judged(replace(estimate_on(), sized=None)).verdict.reasons == ()


def test_cartilage_that_the_plan_knows_roughly_may_look_like_another_size() -> None:
    """Where its thickness was fitted, the size's own deviation knows of it."""
    sd_mm = np.full(len(BONE.mesh.vertices_mm), 0.35)
    model = RegistrationModel(replace(BONE, cartilage_sd_mm=sd_mm))
    assert Reason.SIZE_DIFFERS not in judged_with_size(1.0, 0.1, model).reasons
    assert Reason.SIZE_DIFFERS in judged_with_size(1.0, 0.1, model, thickness_ratio=0.5).reasons


def test_the_right_bone_has_the_right_size_and_a_larger_one_has_not() -> None:
    mesh = BONE.mesh
    for size, reasons in ((1.0, False), (0.95, True)):
        scaled = mesh.centroid_mm + size * (mesh.vertices_mm - mesh.centroid_mm)
        model = RegistrationModel(replace(BONE, mesh=replace(mesh, vertices_mm=scaled)))
        scene = replace(scene_of(MAP), tells_shape=True)
        verdict = judged(fit_bimcc(scene, model, TRUE, FREE_SETTINGS), model=model).verdict
        assert (Reason.SIZE_DIFFERS in verdict.reasons) == reasons


def test_targets_far_from_the_seen_surface_are_less_certain() -> None:
    near = BONE.mesh.vertices_mm[BONE.mesh.vertices_mm[:, 2].argmin()][None]
    bounds = [bound_mm(near + np.array([0.0, 0.0, away])) for away in (0.0, 300.0)]
    assert bounds[1] > 2.0 * bounds[0]


def test_a_jump_from_the_prediction_is_doubted() -> None:
    near, far = disturbed(MODEL, 2.0, 11.0, 4), disturbed(MODEL, 2.0, 13.0, 4)
    assert verdict_on(predicted=near).status is Status.OK
    verdict = verdict_on(predicted=far)
    assert verdict.status is Status.DEGRADED
    assert verdict.reasons == (Reason.JUMPED,)


def test_a_turn_in_place_is_a_jump_as_well() -> None:
    turned, little = disturbed(MODEL, 12.0, 1.0, 4), disturbed(MODEL, 8.0, 1.0, 4)
    assert verdict_on(predicted=little).status is Status.OK
    assert verdict_on(predicted=turned).reasons == (Reason.JUMPED,)


def test_a_bone_that_is_nowhere_in_the_box_is_out_of_view() -> None:
    away = TRUE.move((400.0, 0.0, 0.0, 0.0, 0.0, 0.0), np.zeros(3))
    verdict = judged(replace(estimate_on(), camera_from_bone=away)).verdict
    assert (verdict.status, verdict.reasons) == (Status.LOST, (Reason.OUT_OF_VIEW,))
    assert verdict.predicted_tre_mm is None


def test_a_pose_that_nothing_fixes_is_lost_and_not_told() -> None:
    for reasons in ((), (Reason.DEGENERATE,)):
        free = replace(estimate_on(), covariance=np.diag([np.inf] * 6), reasons=reasons)
        tracked = judged(free)
        assert tracked.verdict.status is Status.LOST
        assert tracked.verdict.reasons == (Reason.DEGENERATE,)
        assert tracked.estimate is None


def test_an_unknown_map_is_lost() -> None:
    unknown = DisparityMap(
        np.full_like(MAP.disparity_px, np.nan), MAP.sigma_px,
        np.zeros_like(MAP.origin), MAP.x, MAP.y,
    )  # fmt: skip
    verdict = verdict_on(measured=unknown)
    assert verdict.status is Status.LOST
    assert Reason.TOO_FEW_POINTS in verdict.reasons
    assert verdict.predicted_tre_mm is None


def covered(thickness_mm: float):
    """A bone with cartilage of one thickness, and the map that shows its surface."""
    n = len(BONE.mesh.vertices_mm)
    bone = replace(BONE, cartilage_mm=np.full(n, thickness_mm))
    surface = replace(
        BONE,
        mesh=replace(
            BONE.mesh, vertices_mm=BONE.mesh.vertices_mm + thickness_mm * BONE.mesh.normals
        ),
    )
    return bone, measured_map(surface)


def test_cartilage_that_the_plan_knows_is_expected() -> None:
    bone, measured = covered(2.0)
    verdict = verdict_on(measured=measured, model=RegistrationModel(bone))
    assert verdict.status is Status.OK
    assert verdict.coverage > 0.9


def test_cartilage_that_the_plan_does_not_know_is_not_ok() -> None:
    _, measured = covered(2.0)
    assert verdict_on(measured=measured).status is not Status.OK


def test_parts_that_were_cut_away_are_not_expected() -> None:
    removed = BONE.mesh.vertices_mm[:, 0] > 5.0
    kept = ~removed[BONE.mesh.faces].any(axis=1)
    rest = replace(BONE, mesh=replace(BONE.mesh, faces=BONE.mesh.faces[kept]))
    model = RegistrationModel(replace(BONE, is_removed=removed))
    seen = measured_map(rest)
    found = compare(model.render(TRUE, GEOMETRY, seen.box), model, seen, GEOMETRY)
    assert found.coverage > 0.85
