import pytest

from navapp.tracking.buried import BuriedBone
from navapp.tracking.locator import WIDE_VIEW
from navapp.values import Prior, Status
from tests.tracking.rooms import GOAL, Room, room


def off(a: Room, twist: tuple[float, ...]):
    """A pose beside the rectified truth of the first frame, and the pictures there."""
    frame = a.frames[0]
    true = a.line._rectified(a.truth(frame))
    rough = true.moved(twist, true.apply(a.line.centre_mm))
    pair, _ = a.line._meter.rectified(frame.left, frame.right, rough, WIDE_VIEW)
    return rough, pair


def error_mm(a: Room, fit) -> float:
    left_from_rectified = a.line._meter.geometry.rectified_from_left.inverse()
    return a.error_mm(left_from_rectified @ fit.pose, a.frames[0])


@pytest.mark.slow
def test_a_rough_pose_leads_to_the_bone() -> None:
    a = room()
    rough, pair = off(a, (9.0, -8.0, 6.0, 0.1, 0.08, -0.06))
    measured = a.line._meter.freely(pair, rough, a.line.locator.settings.search)
    told: list[float] = []
    found = a.line._buried.found(pair, measured, rough, told.append)
    assert error_mm(a, found) < 0.2
    assert told == sorted(told)
    assert told[-1] <= 1.0


@pytest.mark.slow
def test_it_looks_around_a_prediction_from_which_nothing_answers() -> None:
    a = room()
    predicted, pair = off(a, (1.6, -1.2, 1.4, 0.02, -0.02, 0.01))
    *_, best = a.line._buried.followed(pair, predicted, searches=True)
    assert error_mm(a, best) < 0.2
    without = list(a.line._buried.followed(pair, predicted, searches=False))
    assert all(error_mm(a, fit) > 0.5 for fit in without)


def test_the_best_answer_comes_first_and_a_sure_one_ends_the_search(monkeypatch) -> None:
    a = room()
    frame, asked = a.frames[0], []
    monkeypatch.setattr(BuriedBone, "found", lambda *of: asked.append(of) or None)
    answers = a.line.register(frame.left, frame.right, a.prior, GOAL)
    assert answers[0].verdict.status is Status.OK
    assert not asked
    true = a.truth(frame)
    far_off = true.moved((0.0, 60.0, 0.0, 1.5, 0.0, 0.0), true.apply(a.line.centre_mm))
    answers = a.line.register(frame.left, frame.right, Prior({"femur": far_off}), GOAL)
    assert asked
    orders = [one.verdict.order for one in answers]
    assert orders == sorted(orders)
    assert all(one.verdict.status is not Status.OK for one in answers)
