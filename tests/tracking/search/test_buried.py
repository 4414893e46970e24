"""A bone that tissue continues."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.search import buried
from navapp.tracking.surface_meter import WIDE_BOX
from navapp.values import Prior, Status
from tests.tracking.rooms import GOAL, Room, room


def off(a: Room, twist: tuple[float, ...]) -> Frame:
    """The first frame, expected beside the truth."""
    taken = a.frames[0]
    true = a.truth(taken)
    rough = true.move(twist, true.apply(a.tracker.model.centre_mm))
    return a.tracker.begin(taken, rough)


def error_mm(a: Room, fit: Fit) -> float:
    left_from_rectified = a.tracker.meter.geometry.rectified_from_left.inverse()
    return a.error_mm(left_from_rectified @ fit.pose, a.frames[0])


@pytest.mark.slow
def test_a_rough_pose_leads_to_the_bone() -> None:
    a, told = room(), []
    frame = replace(off(a, (9.0, -8.0, 6.0, 0.1, 0.08, -0.06)), on_progress=told.append)
    measured = a.tracker.meter.measure_freely(frame.pair, frame.start, WIDE_BOX)
    found = a.tracker.buried.find_around(frame, measured)
    assert error_mm(a, found) < 0.2
    assert told == sorted(told)
    assert told[-1] <= 1.0


@pytest.mark.release
@pytest.mark.slow
def test_it_looks_around_a_prediction_from_which_nothing_answers() -> None:
    a = room()
    frame = off(a, (1.6, -1.2, 1.4, 0.02, -0.02, 0.01))
    (best,) = a.tracker.buried.find(frame)
    assert error_mm(a, best) < 0.2


def test_both_threads_find_what_one_alone_finds(monkeypatch) -> None:
    a = room()
    frame = off(a, (0.8, -0.6, 0.7, 0.01, -0.01, 0.005))
    true = a.tracker.rectify_pose(a.truth(a.frames[0]))
    starts = [frame.start, true, frame.start.move((0.1, 0, 0, 0, 0, 0), (0, 0, 0))]
    places = a.tracker.buried._step_from(frame, starts)
    monkeypatch.setattr(buried, "map_both", lambda job, items, _: [job(item) for item in items])
    alone = a.tracker.buried._step_from(frame, starts)
    assert len(places) == 3
    assert [place.score for place in places] == [place.score for place in alone]
    for one, other in zip(places, alone, strict=True):
        np.testing.assert_array_equal(one.fit.pose.matrix, other.fit.pose.matrix)


class Asked:
    """Notes what it is asked for, and finds nothing."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []

    def find_around(self, frame: Frame, measured) -> None:
        self.frames.append(frame)


@pytest.mark.release
def test_the_best_answer_comes_first_and_a_sure_one_ends_the_search() -> None:
    a, asked = room(), Asked()
    frame = a.frames[0]
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.buried = asked
    answers = tracker.register(frame, a.prior, GOAL)
    assert answers[0].verdict.status is Status.OK
    assert not asked.frames
    true = a.truth(frame)
    far_off = true.move((0.0, 60.0, 0.0, 1.5, 0.0, 0.0), true.apply(tracker.model.centre_mm))
    answers = tracker.register(frame, Prior({"femur": far_off}), GOAL)
    assert asked.frames
    orders = [one.verdict.rank for one in answers]
    assert orders == sorted(orders)
    assert all(one.verdict.status is not Status.OK for one in answers)
