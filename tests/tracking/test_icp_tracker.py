"""The paper's chains as trackers."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.registration import solve_bimcc_literal, solve_icp
from navapp.tracking import TrackerSettings, TrackState, make_tracker
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.icp_tracker import IcpTracker
from navapp.tracking.paper_tracker import PaperTracker
from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, WIDE_BOX, WIDE_VIEW
from navapp.values import Origin, Prior, Reason, Status
from tests.pictures import Pictures
from tests.tracking.meters import Listening
from tests.tracking.rooms import GOAL, room


def tracker() -> IcpTracker:
    a = room()
    return IcpTracker(a.rig, a.tracker.model.bone)


def test_a_tracker_is_made_by_the_name_of_its_method() -> None:
    a = room()
    bone = a.tracker.model.bone
    assert type(make_tracker(a.rig, bone)) is BimccTracker
    assert type(make_tracker(a.rig, bone, TrackerSettings("bimcc"))) is BimccTracker
    made = make_tracker(a.rig, bone, TrackerSettings("icp", follows_refused=True))
    assert type(made) is IcpTracker
    assert made.settings.follows_refused
    assert type(make_tracker(a.rig, bone, TrackerSettings("paper"))) is PaperTracker


@pytest.mark.release
@pytest.mark.parametrize("kind", [IcpTracker, PaperTracker])
def test_one_fit_to_so_many_points_makes_an_answer(kind) -> None:
    """At a glance around the pose, at a first registration with more room."""
    a = room()
    frame, truth = a.frames[0], a.truth(a.frames[0])
    start = truth.move((0.5, -0.5, 1.0, 0.01, 0.0, 0.0), truth.apply(a.tracker.model.centre_mm))
    for margins, view in ((NEAR_BOX, NEAR_VIEW), (WIDE_BOX, WIDE_VIEW)):
        made = kind(a.rig, a.tracker.model.bone)
        begun = made.begin(frame, start, view)
        fit = made.find_fit(begun, margins)
        assert len(fit.measured.cloud) == (3000 if kind is IcpTracker else 20_000)
        if margins is NEAR_BOX:
            state = TrackState.at_rest(start, 0)
            tracked, _ = made.glance(replace(frame, captured_ns=0), state, GOAL)
        else:
            (tracked,) = made.register(frame, Prior({"femur": start}), GOAL)
        left_from_rectified = made.meter.geometry.rectified_from_left.inverse()
        found = left_from_rectified @ fit.pose
        np.testing.assert_array_equal(tracked.left_from_bone.matrix, found.matrix)


def test_each_chain_takes_its_own_steps() -> None:
    """Section 3.1: matched pixels, plain ICP, contour; section 3.2: filled ones, BiMCC-ICP."""
    a = room()
    frame, truth = a.frames[0], a.truth(a.frames[0])
    bone = a.tracker.model.bone
    for kind, solve in (
        (IcpTracker, solve_icp),
        (PaperTracker, solve_bimcc_literal),
    ):
        made = kind(a.rig, bone)
        begun = made.begin(frame, truth, NEAR_VIEW)
        fit = made.find_fit(begun, NEAR_BOX)
        solved = solve(fit.measured.scene, made.model, begun.start, 3000).estimate
        disparity = fit.measured.disparity
        expected = solved.camera_from_bone
        if kind is IcpTracker:
            expected = made.judge.outline.refine(begun.pair, expected, disparity)
        np.testing.assert_array_equal(fit.pose.matrix, expected.matrix)
        filled = {Origin.FILLED_BORDER, Origin.FILLED_INTERIOR, Origin.MISMATCH_FILLED}
        has_filled = bool(filled & set(np.unique(fit.measured.cloud.origin)))
        assert has_filled is (kind is PaperTracker)
        assert (begun.watch.timings.fill_ms > 0.0) is (kind is PaperTracker)
        assert begun.watch.timings.stereo_ms > 0.0


def test_the_papers_proposal_finds_what_its_state_of_the_art_does_not() -> None:
    a = room()
    frame, truth = a.frames[0], a.truth(a.frames[0])
    start = truth.move((1.0, -1.0, 1.0, 0.02, 0.0, 0.01), truth.apply(a.tracker.model.centre_mm))
    errors = []
    for kind in (PaperTracker, IcpTracker):
        made = kind(a.rig, a.tracker.model.bone, TrackerSettings(follows_refused=True))
        (found,) = made.register(frame, Prior({"femur": start}), GOAL)
        errors.append(a.error_mm(found.left_from_bone, frame))
        assert found.verdict.status is not Status.OK
    assert errors[0] < 2.5
    assert errors[1] > 5.0 * errors[0]


def test_a_refused_pose_is_followed_when_that_is_asked_for() -> None:
    a = room()
    frame, truth = a.frames[0], a.truth(a.frames[0])
    for follows in (False, True):
        made = IcpTracker(a.rig, a.tracker.model.bone, TrackerSettings("icp", follows))
        state = TrackState.at_rest(truth, frame.captured_ns - 66_000_000)
        tracked, after = made.track(frame, state, GOAL)
        assert tracked.verdict.status is Status.LOST
        assert after.n_lost == (0 if follows else 1)
        assert (after.left_from_bone is tracked.left_from_bone) is follows


def test_pictures_without_content_are_lost() -> None:
    a, icp = room(), tracker()
    flat = Pictures(*np.zeros((2, 720, 1280, 3), dtype=np.uint8), 66_000_000)
    state = TrackState.at_rest(a.truth(a.frames[0]), 0)
    tracked, after = icp.track(flat, state, GOAL)
    assert tracked.verdict.status is Status.LOST
    assert tracked.verdict.reasons
    assert tracked.left_from_bone is None
    assert after.left_from_bone is state.left_from_bone
    found = icp.register(flat, a.prior, GOAL)
    assert [one.verdict.status for one in found] == [Status.LOST]
    assessed = icp.assess(flat, state.left_from_bone, GOAL)
    assert assessed.verdict.status is Status.LOST


@pytest.mark.parametrize("n_lost", [0, 1])
def test_out_of_view_it_is_lost_and_said_so(n_lost: int) -> None:
    a, icp = room(), tracker()
    frame = a.frames[0]
    away = a.truth(frame).move((900.0, 0, 0, 0, 0, 0), (0.0, 0.0, 0.0))
    state = replace(TrackState.at_rest(away, frame.captured_ns), n_lost=n_lost)
    tracked, after = icp.track(frame, state, GOAL)
    assert tracked.verdict.reasons == (Reason.OUT_OF_VIEW,)
    assert after.n_lost == n_lost + 1
    found = icp.register(frame, Prior({"femur": away}), GOAL)
    assert [one.verdict.status for one in found] == [Status.LOST]


def test_a_first_registration_needs_a_pose() -> None:
    frame = room().frames[0]
    prior = Prior(box=(500, 200, 300, 300))
    assert tracker().register(frame, prior, GOAL) == []


def test_it_is_lost_where_it_was_and_looks_no_further_off() -> None:
    """In every lost frame: the pose and the place of the box are all that it starts from."""
    a, icp = room(), tracker()
    frame, meter = a.frames[0], Listening(icp.meter, "find_region")
    icp.meter = meter
    for n_lost in range(4):
        state = replace(TrackState.at_rest(a.truth(frame), frame.captured_ns), n_lost=n_lost)
        meter.given.clear()
        icp.track(frame, state, GOAL)
        margins = [given[1] for given in meter.given if given[1] in (NEAR_BOX, WIDE_BOX)]
        assert margins[-1] == (WIDE_BOX if n_lost else NEAR_BOX)


def test_it_follows_the_box() -> None:
    """Its judge accepts nothing, and still its start goes with the pictures."""
    a, icp = room(), tracker()
    frame, moved = a.frames[0], 60
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    _, state = icp.track(frame, state, GOAL)
    start = state.box.picture_box
    left, right = (np.roll(eye, moved, axis=1) for eye in (frame.left, frame.right))
    shifted = Pictures(left, right, frame.captured_ns + 66_000_000)
    _, state = icp.track(shifted, state, GOAL)
    assert state.box.picture_box.x == pytest.approx(start.x + moved, abs=6.0)


def test_the_pose_that_motion_lets_expect_is_what_a_jump_is_measured_from() -> None:
    """Not the place of the box, at which the fit begins."""
    a, icp, judged = room(), tracker(), []
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    whole = icp.judge.judge
    icp.judge.judge = lambda frame, *given: judged.append(frame) or whole(frame, *given)
    _, state = icp.track(frame, state, GOAL)
    left, right = (np.roll(eye, 60, axis=1) for eye in (frame.left, frame.right))
    shifted = Pictures(left, right, frame.captured_ns + 66_000_000)
    expected = icp.rectify_pose(state.predict(shifted.captured_ns, icp.model.centre_mm))
    icp.track(shifted, state, GOAL)
    np.testing.assert_array_equal(judged[-1].predicted.matrix, expected.matrix)
    assert np.abs(judged[-1].start.matrix - expected.matrix).max() > 1.0
