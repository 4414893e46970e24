"""Parts of the production chain that an evaluation leaves out: it alone is missing then."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.registration import Scene, fit_bimcc
from navapp.registration.residual_blocks import ResidualBlock
from navapp.tracking import Part, TrackerSettings, TrackState
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.frame import FREE_SETTINGS
from navapp.tracking.surface_meter import WIDE_BOX
from navapp.values import Reason, Status, TrackedFrame
from tests.tracking.rooms import GOAL, room
from tests.tracking.test_judging_fits import found_at_the_truth


def without(*parts: Part) -> BimccTracker:
    a = room()
    settings = TrackerSettings(leaves_out=frozenset(parts))
    return BimccTracker(a.rig, a.tracker.model.bone, settings)


def answers_of(tracker: BimccTracker) -> list[TrackedFrame]:
    """Registered from the prior in the first frame, then followed."""
    a = room()
    first, *others = a.frames
    found = tracker.register(first, a.prior, GOAL)
    answers, state = [found[0]], TrackState.at_rest(found[0].left_from_bone, first.captured_ns)
    for frame in others:
        answer, state = tracker.track(frame, state, GOAL)
        answers.append(answer)
    return answers


def assert_same(these: list[TrackedFrame], those: list[TrackedFrame]) -> None:
    for one, other in zip(these, those, strict=True):
        assert one.verdict == other.verdict
        np.testing.assert_array_equal(one.left_from_bone.matrix, other.left_from_bone.matrix)
        np.testing.assert_array_equal(one.estimate.covariance, other.estimate.covariance)


def test_nothing_is_left_out_unless_it_is_asked_for() -> None:
    assert TrackerSettings().leaves_out == frozenset()
    answers = answers_of(without())
    assert_same(answers, answers_of(room().tracker))
    assert all(one.foreground is not None for one in answers[1:])


def test_without_the_fill_every_pose_is_the_same_and_no_foreground_is_told() -> None:
    answers = answers_of(without("fill"))
    assert_same(answers, answers_of(room().tracker))
    assert all(one.foreground is None for one in answers)
    assert all(one.timings.fill_ms == 0.0 for one in answers)


def scene_around(tracker: BimccTracker, off_mm: float) -> tuple[Scene, RigidTransform]:
    """What is measured freely around the true pose, and a start beside it."""
    a = room()
    picture = a.frames[0]
    frame = tracker.begin(picture, a.truth(picture))
    measured = tracker.meter.measure_freely(frame.pair, frame.start, WIDE_BOX)
    centre_mm = frame.start.apply(tracker.model.centre_mm)
    return measured.scene, frame.start.move((off_mm, off_mm, 0.0, 0.2, 0.0, 0.0), centre_mm)


@pytest.mark.parametrize(("parts", "asks"), [((), True), (("backward pairs",), False)])
def test_points_of_the_model_look_for_partners_only_where_they_may(parts, asks) -> None:
    tracker = without(*parts)
    scene, far = scene_around(tracker, 15.0)
    fit_bimcc(scene, tracker.model, far, FREE_SETTINGS)
    # The grid, in which they look, is made when it is needed.
    assert ("grid" in vars(scene)) == asks


def test_without_the_contour_the_pose_is_that_of_the_surface() -> None:
    a, tracker = room(), without("contour")
    frame, fit = found_at_the_truth(a)
    told = tracker.judge.judge(frame, fit, GOAL)
    surface = tracker.meter.geometry.rectified_from_left.inverse() @ fit.pose
    np.testing.assert_array_equal(told.left_from_bone.matrix, surface.matrix)
    joined = a.tracker.judge.judge(frame, fit, GOAL)
    assert np.abs(joined.left_from_bone.matrix - surface.matrix).max() > 0.0
    assert np.trace(told.estimate.covariance) > np.trace(joined.estimate.covariance)


def test_without_an_outline_a_fit_is_as_with_one_of_which_nothing_is_found(monkeypatch) -> None:
    a = room()
    frame, fit = found_at_the_truth(a)
    outline = a.tracker.judge.outline
    nothing = ResidualBlock(
        np.empty((0, 6)), np.empty(0), np.empty(0), np.empty(0), 0.3, np.empty((0, 3))
    )
    monkeypatch.setattr(outline, "block", lambda *_, **__: nothing)
    for noise in (1.0, 0.4):
        expected = outline.join(frame.pair, fit, None, noise).estimate
        found = fit.estimate.scale_noise(noise)
        np.testing.assert_array_equal(found.covariance, expected.covariance)
        np.testing.assert_array_equal(found.sized.covariance, expected.sized.covariance)
        np.testing.assert_array_equal(found.sized.step, expected.sized.step)
        np.testing.assert_array_equal(
            found.camera_from_bone.matrix, expected.camera_from_bone.matrix
        )
        assert found.reasons == expected.reasons


@pytest.mark.parametrize(("parts", "n_looks"), [((), 1), (("second look",), 0)])
def test_without_the_second_look_an_answer_stays_doubted(parts, n_looks) -> None:
    a, tracker, looked = room(), without(*parts), []
    tracker.highlights = SimpleNamespace(find=lambda *given: looked.append(given) or [])
    frame, fit = found_at_the_truth(a)
    answer = tracker.judge.judge(frame, fit, GOAL)
    doubted = _doubt(answer)
    assert tracker.look_again(frame, doubted, GOAL) is doubted
    assert len(looked) == n_looks


def _doubt(answer: TrackedFrame) -> TrackedFrame:
    verdict = replace(answer.verdict, status=Status.DEGRADED, reasons=(Reason.COVERAGE_LOW,))
    return replace(answer, verdict=verdict)


def test_without_the_judge_a_wrong_pose_is_ok_and_carried_on() -> None:
    a = room()
    picture = a.frames[0]
    truth = a.truth(picture)
    wrong = truth.move((6.0, 0.0, 0.0, 0.0, 0.0, 0.1), truth.apply(a.tracker.model.centre_mm))
    asked = a.tracker.assess(picture, wrong, GOAL)
    believed = without("judge").assess(picture, wrong, GOAL)
    assert asked.verdict.status is not Status.OK
    assert asked.verdict.reasons
    assert (believed.verdict.status, believed.verdict.reasons) == (Status.OK, ())
    # What the judge would say of its error is still told.
    assert believed.verdict.predicted_tre_mm == asked.verdict.predicted_tre_mm
    np.testing.assert_array_equal(believed.left_from_bone.matrix, asked.left_from_bone.matrix)
    after = TrackState.at_rest(truth, 0).update(believed, 1, a.tracker.model.centre_mm)
    assert (after.n_lost, after.left_from_bone) == (0, believed.left_from_bone)


def test_without_the_judge_what_is_not_found_is_still_lost() -> None:
    a, tracker = room(), without("judge")
    frame, _ = found_at_the_truth(a)
    answer = tracker.judge.judge(frame, None, GOAL)
    assert (answer.verdict.status, answer.estimate) == (Status.LOST, None)
