"""The paper's baseline as a tracker."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.registration import solve_icp
from navapp.tracking import TrackerSettings, TrackState, make_tracker
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.icp_tracker import IcpTracker, match_gradients
from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, WIDE_BOX, WIDE_VIEW
from navapp.values import Prior, Reason, Status, Stopwatch
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
    made = make_tracker(a.rig, bone, TrackerSettings("icp", max_points=900))
    assert type(made) is IcpTracker
    assert made.settings.max_points == 900


def test_one_matching_and_one_fit_make_an_answer() -> None:
    """At a glance around the pose, at a first registration with more room."""
    a = room()
    frame, truth = a.frames[0], a.truth(a.frames[0])
    start = truth.move((0.5, -0.5, 1.0, 0.01, 0.0, 0.0), truth.apply(a.tracker.centre_mm))
    for margins, view in ((NEAR_BOX, NEAR_VIEW), (WIDE_BOX, WIDE_VIEW)):
        icp = tracker()
        icp.meter = meter = Listening(icp.meter)
        given = (frame.left, frame.right)
        if margins is NEAR_BOX:
            tracked, _ = icp.glance(*given, 0, TrackState.at_rest(start, 0), GOAL)
        else:
            (tracked,) = icp.register(*given, Prior({"femur": start}), GOAL)
        assert meter.asked == ["measure_freely"]
        assert meter.given[0][2:] == (margins, match_gradients)
        begun = icp.begin(*given, start, Stopwatch(), view)
        measured = a.tracker.meter.measure_freely(begun.pair, begun.start, margins, match_gradients)
        expected = solve_icp(measured.scene, icp.model, begun.start).estimate.camera_from_bone
        left_from_rectified = icp.meter.geometry.rectified_from_left.inverse()
        np.testing.assert_array_equal(
            tracked.left_from_bone.matrix, (left_from_rectified @ expected).matrix
        )


def test_pictures_without_content_are_lost() -> None:
    a, icp = room(), tracker()
    flat = np.zeros((720, 1280, 3), dtype=np.uint8)
    state = TrackState.at_rest(a.truth(a.frames[0]), 0)
    tracked, after = icp.track(flat, flat, 66_000_000, state, GOAL)
    assert tracked.verdict.status is Status.LOST
    assert tracked.verdict.reasons
    assert tracked.left_from_bone is None
    assert after.left_from_bone is state.left_from_bone
    found = icp.register(flat, flat, a.prior, GOAL)
    assert [one.verdict.status for one in found] == [Status.LOST]
    assessed = icp.assess(flat, flat, state.left_from_bone, GOAL)
    assert assessed.verdict.status is Status.LOST


@pytest.mark.parametrize("n_lost", [0, 1])
def test_out_of_view_it_is_lost_and_said_so(n_lost: int) -> None:
    a, icp = room(), tracker()
    frame = a.frames[0]
    away = a.truth(frame).move((900.0, 0, 0, 0, 0, 0), (0.0, 0.0, 0.0))
    state = replace(TrackState.at_rest(away, frame.captured_ns), n_lost=n_lost)
    tracked, after = icp.track(frame.left, frame.right, frame.captured_ns, state, GOAL)
    assert tracked.verdict.reasons == (Reason.OUT_OF_VIEW,)
    assert after.n_lost == n_lost + 1
    found = icp.register(frame.left, frame.right, Prior({"femur": away}), GOAL)
    assert [one.verdict.status for one in found] == [Status.LOST]


def test_a_first_registration_needs_a_pose() -> None:
    frame = room().frames[0]
    prior = Prior({}, None, 180.0, (500, 200, 300, 300))
    assert tracker().register(frame.left, frame.right, prior, GOAL) == []


def test_it_is_lost_where_it_was_and_looks_no_further_off() -> None:
    """In every lost frame: the pose and the place of the box are all that it starts from."""
    a, icp = room(), tracker()
    frame, meter = a.frames[0], Listening(icp.meter)
    icp.meter = meter
    for n_lost in range(4):
        state = replace(TrackState.at_rest(a.truth(frame), frame.captured_ns), n_lost=n_lost)
        meter.given.clear()
        icp.track(frame.left, frame.right, frame.captured_ns, state, GOAL)
        margins = [given[2] for given in meter.given]
        assert margins[-1] == WIDE_BOX
        assert len(margins) == (2 if n_lost == 0 else 1)


def test_it_follows_the_box() -> None:
    """Its judge accepts nothing, and still its start goes with the pictures."""
    a, icp = room(), tracker()
    frame, moved = a.frames[0], 60
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    _, state = icp.track(frame.left, frame.right, frame.captured_ns, state, GOAL)
    start = state.box.picture_box
    left, right = (np.roll(eye, moved, axis=1) for eye in (frame.left, frame.right))
    _, state = icp.track(left, right, frame.captured_ns + 66_000_000, state, GOAL)
    assert state.box.picture_box.x == pytest.approx(start.x + moved, abs=6.0)
