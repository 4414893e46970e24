"""A bone behind another one: what is rendered, what is measured, and how a spread is judged."""

from copy import copy

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render_rectified
from navapp.joint.occluded_tracker import OccludedTracker, Occluder
from navapp.tracking import TrackerSettings, TrackState
from navapp.tracking.agreement import Agreement
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.frame import Fit
from navapp.tracking.judging import PoseJudge
from navapp.values import DisparityMap, Status
from tests.geometry.shapes import sphere
from tests.registration.shapes import GEOMETRY
from tests.tracking.rooms import GOAL, room

BALL = sphere(10.0, 48)
BOX = Box(500, 250, 280, 220)


def ahead(x_mm: float = 0.0, depth_mm: float = 400.0) -> RigidTransform:
    return RigidTransform.from_parts("left_rect", "ball", np.eye(3), (x_mm, 0.0, depth_mm))


def occluder() -> Occluder:
    return Occluder(BALL, ahead(), GEOMETRY)


def test_what_lies_behind_is_not_rendered_and_a_rim_beside_neither() -> None:
    behind = render_rectified(BALL, ahead(10.0, 430.0), GEOMETRY, BOX)
    hidden = occluder().hide(behind)
    mask = render_rectified(BALL, ahead(), GEOMETRY, BOX).mask
    assert behind.mask[mask].any()
    assert not hidden.mask[mask].any()
    assert 0 < hidden.mask.sum() < (behind.mask & ~mask).sum()
    assert np.isnan(hidden.depth_mm[~hidden.mask]).all()
    # The view itself stays as it was.
    assert behind.mask[mask].any()


def test_what_lies_before_stays() -> None:
    before = render_rectified(BALL, ahead(10.0, 350.0), GEOMETRY, BOX)
    assert (occluder().hide(before).mask == before.mask).all()


def test_what_was_measured_on_it_is_removed_and_what_is_nearer_is_not() -> None:
    view = render_rectified(BALL, ahead(), GEOMETRY, BOX)
    for off_mm, stays in ((0.0, False), (1.0, False), (-5.0, True), (20.0, False)):
        px = GEOMETRY.disparity_map_px(np.where(view.mask, view.depth_mm + off_mm, 600.0))
        shape = px.shape
        found = DisparityMap(
            px.astype(np.float32), np.full(shape, 0.1, np.float32), np.ones(shape, np.uint8),
            BOX.x, BOX.y,
        )  # fmt: skip
        left = occluder().remove(found).origin > 0
        assert left[view.mask].any() == stays
        assert left[0, 0]


def hidden_room(spread=None):
    a = room()
    far = RigidTransform.from_parts("left", "ball", np.eye(3), (0.0, 0.0, 5000.0))
    return a, OccludedTracker(a.tracker, BALL, far, spread)


def test_behind_nothing_a_bone_is_judged_as_ever() -> None:
    """But that it is not matched up to its outlines."""
    a, hidden = hidden_room()
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    args = frame, state, GOAL
    clear = copy(a.tracker.meter)
    clear.leaves_out_outlines = True
    seen = BimccTracker(a.rig, a.tracker.model.bone, meter=clear)
    one, other = (tracker.glance(*args)[0] for tracker in (seen, hidden))
    assert one.verdict.status is Status.OK
    assert other.verdict == one.verdict
    assert (other.estimate.covariance == one.estimate.covariance).all()


def test_what_is_left_out_of_the_tracker_is_left_out_behind_the_occluder() -> None:
    a = room()
    settings = TrackerSettings(leaves_out=frozenset({"backward pairs"}))
    tracker = BimccTracker(a.rig, a.tracker.model.bone, settings)
    far = RigidTransform.from_parts("left", "ball", np.eye(3), (0.0, 0.0, 5000.0))
    assert hidden_room()[1].model.pairs_backward
    assert not OccludedTracker(tracker, BALL, far).model.pairs_backward


def test_a_spread_makes_the_bound_larger_and_moves_nothing() -> None:
    a, plain = hidden_room()
    _, spread = hidden_room(np.diag([0.01] * 3 + [0.0] * 3))
    frame = a.frames[0]
    poses = []
    for tracker in (plain, spread):
        begun = tracker.begin(frame, a.truth(frame))
        fit = next(tracker.near.find_on_model(begun))
        poses.append(tracker.judge.judge(begun, fit, GOAL))
    assert (poses[0].left_from_bone.matrix == poses[1].left_from_bone.matrix).all()
    grown = poses[1].estimate.covariance - poses[0].estimate.covariance
    assert np.trace(grown) == pytest.approx(0.03)
    assert poses[1].verdict.predicted_tre_mm > poses[0].verdict.predicted_tre_mm


class ClaimsStand(PoseJudge):
    """Takes noise as it is claimed, of every bone."""

    def _noise_variance_ratio(self, fit: Fit, agreement: Agreement) -> float:
        return 1.0


def test_a_bone_that_is_hidden_for_the_most_part_does_not_lie_in_the_open() -> None:
    """Though most of what is left of it is seen: its noise counts as it is claimed."""
    a = room()
    frame = a.frames[0]
    start = a.truth(frame)
    near = start.apply(a.tracker.model.centre_mm) * 0.9
    bounds = {}
    for radius_mm in (1.0, 22.0):
        ball = sphere(radius_mm, 48)
        before = RigidTransform.from_parts("left", "ball", np.eye(3), near)
        hidden = OccludedTracker(a.tracker, ball, before)
        begun = hidden.begin(frame, start)
        fit = next(hidden.near.find_on_model(begun))
        judges = [kind(hidden.meter, TrackerSettings()) for kind in (PoseJudge, ClaimsStand)]
        bounds[radius_mm] = [
            np.trace(judge.judge(begun, fit, GOAL).estimate.covariance)
            for judge in (*judges, hidden.judge)
        ]
    small, large = bounds.values()
    assert small[2] == pytest.approx(small[0])
    assert large[2] == pytest.approx(large[1])
    assert large[2] > 1.5 * large[0]
