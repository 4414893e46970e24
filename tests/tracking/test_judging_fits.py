"""Fits on pictures, joined and weighed before they are judged."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.registration import RegistrationModel, solution_at
from navapp.tracking import TrackerSettings, TrackState, judging
from navapp.tracking.agreement import compare
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.checks import PairChecks
from navapp.tracking.frame import FREE_SETTINGS, Fit, Frame
from navapp.tracking.judging import PoseJudge
from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, WIDE_VIEW, SurfaceMeter
from navapp.values import Reason, Status, TrackedFrame
from tests.tracking.judged import SurfaceAlone, Told, altered
from tests.tracking.rooms import GOAL, Room, room


def judge_with(outline: SurfaceAlone) -> PoseJudge:
    a = room()
    judge = PoseJudge(a.tracker.meter, TrackerSettings())
    judge.outline = outline
    return judge


def tracked(a: Room, tracker: BimccTracker) -> TrackedFrame:
    """Of the first frame, from its truth."""
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    return tracker.track(frame, state, GOAL)[0]


def found_at_the_truth(a: Room) -> tuple[Frame, Fit]:
    taken = a.frames[0]
    frame = a.tracker.begin(taken, a.truth(taken), NEAR_VIEW)
    frame = replace(frame, checks=PairChecks(a.tracker.meter, frame.pair))
    return frame, next(a.tracker.near.find(frame))


def test_the_outline_enters_the_pose_that_is_handed_out() -> None:
    a = room()
    with_it = tracked(a, a.tracker)
    alone = BimccTracker(a.rig, a.tracker.model.bone)
    alone.judge = judge_with(SurfaceAlone())
    without = tracked(a, alone)
    assert np.trace(with_it.estimate.covariance) < np.trace(without.estimate.covariance)
    assert with_it.verdict.predicted_tre_mm < without.verdict.predicted_tre_mm
    error_mm = a.error_mm(with_it.left_from_bone, a.frames[0])
    assert error_mm < with_it.verdict.predicted_tre_mm


def test_the_covariance_turns_with_the_camera_frame() -> None:
    """Handed out in the left camera before rectification, which is a pure rotation."""
    a = room()
    frame, tracker, truth = a.frames[0], a.tracker, a.truth(a.frames[0])
    estimate = tracker.assess(frame, truth, GOAL).estimate
    begun = tracker.begin(frame, truth, WIDE_VIEW)
    measured = tracker.meter.measure_freely(begun.pair, begun.start, NEAR_BOX)
    inside = solution_at(measured.scene, tracker.model, begun.start, FREE_SETTINGS).estimate
    turn = np.kron(np.eye(2), tracker.meter.geometry.rectified_from_left.rotation)
    np.testing.assert_allclose(
        turn @ estimate.covariance @ turn.T, inside.covariance, rtol=1e-9, atol=1e-15
    )
    assert np.abs(estimate.covariance - inside.covariance).max() > 1e-6


@pytest.mark.parametrize(("hidden_fraction", "noise"), [(0.0, 0.57), (0.9, 1.0)])
def test_a_claim_is_believed_less_while_the_bone_lies_open(
    hidden_fraction: float, noise: float
) -> None:
    a = room()
    frame, fit = found_at_the_truth(a)
    checks = altered(frame.checks, fit, hidden_fraction=hidden_fraction)
    told = judge_with(SurfaceAlone()).judge(replace(frame, checks=checks), fit, GOAL)
    expected = noise**2 * fit.estimate.covariance
    turn = np.kron(np.eye(2), a.tracker.meter.geometry.rectified_from_left.rotation)
    np.testing.assert_allclose(
        turn @ told.estimate.covariance @ turn.T, expected, rtol=1e-6, atol=1e-12
    )


@pytest.mark.parametrize("hidden_fraction", [0.0, 0.9])
def test_a_seen_size_is_in_the_bound_and_not_in_the_covariance(hidden_fraction: float) -> None:
    a = room()
    frame, fit = found_at_the_truth(a)
    step = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1])
    grown = replace(fit.estimate, sized=replace(fit.estimate.sized, step=step))
    same = replace(fit.estimate, sized=replace(fit.estimate.sized, step=np.zeros(7)))
    checks = altered(frame.checks, fit, hidden_fraction=hidden_fraction)
    frame = replace(frame, checks=checks)
    large, small = (
        judge_with(SurfaceAlone()).judge(frame, replace(fit, estimate=one), GOAL)
        for one in (grown, same)
    )
    np.testing.assert_array_equal(large.estimate.covariance, small.estimate.covariance)
    assert large.verdict.predicted_tre_mm > small.verdict.predicted_tre_mm + 0.1
    # Handed out in the left camera, like the pose.
    to_left = a.tracker.meter.geometry.rectified_from_left.inverse()
    np.testing.assert_allclose(
        large.estimate.sized.step[:3], to_left.rotation @ step[:3], atol=1e-12
    )


def test_a_fit_on_the_model_is_compared_where_it_was_matched_a_free_one_where_it_rests(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    a = room()
    frame, fit = found_at_the_truth(a)
    as_matched = replace(frame, checks=altered(frame.checks, fit, coverage=0.77))
    judge = judge_with(SurfaceAlone())
    assert judge.judge(as_matched, fit, GOAL).verdict.coverage == 0.77
    check = as_matched.checks.check(fit.measured, fit.pose).result()
    free = replace(fit, measured=replace(fit.measured, rendered=None))
    asked = []
    monkeypatch.setattr(judging, "compare", lambda *said: asked.append(said) or compare(*said))
    as_free = replace(frame, checks=Told(check._replace(agreement=None)))
    answer = judge.judge(as_free, free, GOAL)
    assert asked[0][-1] is check.is_near_clipped
    disparity, geometry = fit.measured.disparity, a.tracker.meter.geometry
    view = a.tracker.model.render(fit.pose, geometry, disparity.box)
    there = compare(view, a.tracker.model, disparity, geometry, check.coarse_px)
    assert answer.verdict.coverage == there.coverage != 0.77


@pytest.mark.parametrize(("moved_mm", "is_as_matched"), [(0.15, True), (0.25, False)])
def test_a_model_that_the_outline_moved_is_compared_anew(
    moved_mm: float, is_as_matched: bool
) -> None:
    a = room()
    frame, fit = found_at_the_truth(a)
    outline = SurfaceAlone(shift_mm=(moved_mm, 0.0, 0.0))
    as_matched = replace(frame, checks=altered(frame.checks, fit, coverage=0.77))
    found = judge_with(outline).judge(as_matched, fit, GOAL).verdict
    assert (found.coverage == 0.77) == is_as_matched


def test_what_residuals_have_in_common_counts_of_a_fit_on_the_model_alone() -> None:
    """Errors of a free measurement go together anyway."""
    a = room()
    frame, fit = found_at_the_truth(a)
    expected_mm = fit.estimate.expected_rms_mm
    noisy, rough = (
        replace(fit, estimate=replace(fit.estimate, rms_mm=times * expected_mm))
        for times in (0.67, 0.95)
    )
    free = replace(rough, measured=replace(fit.measured, rendered=None))
    # All residuals of the noisy one show 0.8 of what they claim: more than correct poses of a
    # femur, but not twice the variance of the noisiest.
    assert noisy.variance_ratio**0.5 == pytest.approx(0.8, abs=0.03)
    for one, is_misfit in ((fit, False), (noisy, False), (rough, True), (free, False)):
        verdict = judge_with(SurfaceAlone()).judge(frame, one, GOAL).verdict
        assert (Reason.SURFACE_MISFIT in verdict.reasons) == is_misfit
        assert verdict.status is not Status.LOST


def test_out_of_view_there_is_nothing_to_judge() -> None:
    a = room()
    frame, _ = found_at_the_truth(a)
    answer = judge_with(SurfaceAlone()).judge(frame, None, GOAL)
    assert answer.verdict.status is Status.LOST
    assert answer.verdict.reasons == (Reason.OUT_OF_VIEW,)
    assert answer.estimate is None


class TwoLooks(SurfaceAlone):
    """Where all of the outline counts, its covariance is so many times as large."""

    def __init__(self, times: float = 1.0) -> None:
        super().__init__()
        self._times = times

    def join(self, *given, counts_unmeasured: bool) -> Fit:
        fit = super().join(*given, counts_unmeasured=counts_unmeasured)
        times = self._times if counts_unmeasured else 1.0
        return replace(fit, estimate=fit.estimate.scale_noise(times))


def judge_of(outline: SurfaceAlone, *, is_worked_on: bool) -> PoseJudge:
    a = room()
    bone = a.tracker.model.bone
    lid = TriangleMesh(bone.mesh.vertices_mm[:3], np.array([[0, 1, 2]]))
    model = RegistrationModel(replace(bone, lid=lid if is_worked_on else None))
    judge = PoseJudge(SurfaceMeter(a.rig, model, a.tracker.meter.depth_mm), TrackerSettings())
    judge.outline = outline
    return judge


@pytest.mark.parametrize(
    ("is_worked_on", "is_loose", "counted"),
    [(True, True, [False, True]), (True, False, [False]), (False, True, [False])],
)
def test_all_of_the_outline_counts_where_too_little_is_left_of_a_bone_that_was_worked_on(
    is_worked_on: bool, is_loose: bool, counted: list[bool]
) -> None:
    frame, fit = found_at_the_truth(room())
    outline = SurfaceAlone()
    goal = replace(GOAL, seen_limit_mm=1e-3 if is_loose else 5.0)
    judge_of(outline, is_worked_on=is_worked_on).judge(frame, fit, goal)
    assert outline.counted_unmeasured == counted


@pytest.mark.parametrize(("times", "is_better"), [(0.01, True), (0.5, False), (100.0, False)])
def test_of_two_looks_at_an_outline_the_better_verdict_counts(
    times: float, is_better: bool
) -> None:
    frame, fit = found_at_the_truth(room())
    alone = judge_of(SurfaceAlone(), is_worked_on=True).judge(frame, fit, GOAL)
    assert alone.verdict.status is Status.OK
    # A little less than what one look leaves open.
    goal = replace(GOAL, seen_limit_mm=0.5 * alone.verdict.predicted_tre_mm)
    found = judge_of(TwoLooks(times), is_worked_on=True).judge(frame, fit, goal)
    assert found.verdict.status is (Status.OK if is_better else Status.DEGRADED)
    expected_mm = alone.verdict.predicted_tre_mm
    if is_better:
        assert found.verdict.predicted_tre_mm < 0.5 * expected_mm
    else:
        assert found.verdict.predicted_tre_mm == pytest.approx(expected_mm)
