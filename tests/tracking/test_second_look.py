"""The first registration looks once more, without highlights, at an answer that is not OK."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from navapp.geometry.transform import RigidTransform
from navapp.tracking import TrackState, bimcc_tracker
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.first_registration import FirstRegistration
from navapp.tracking.frame import Fit, Frame
from navapp.values import Reason, Status, TrackedFrame
from tests.many import few_rows_of
from tests.tracking.rooms import GOAL, room


class Found:
    """Stands for the search without highlights: rests where the surface without them lies."""

    def __init__(self, tracker: BimccTracker) -> None:
        self._tracker, self.n_asked = tracker, 0

    def find(self, frame: Frame, pose: RigidTransform) -> Iterator[Fit]:
        self.n_asked += 1
        yield from self._tracker.near.find_on_model(replace(frame, start=pose))


def found_at_the_truth() -> tuple[BimccTracker, Found, Frame, TrackedFrame]:
    """A tracker, its search without highlights, and the answer at the true pose of a frame."""
    a = room()
    picture = a.frames[0]
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.highlights = found = Found(tracker)
    frame = tracker.begin(picture, a.truth(picture))
    answer = tracker.judge.judge(frame, next(iter(tracker.near.find_on_model(frame))), GOAL)
    return tracker, found, frame, answer


def doubt(answer: TrackedFrame, coverage: float, *reasons: Reason) -> TrackedFrame:
    verdict = replace(answer.verdict, status=Status.DEGRADED, reasons=reasons, coverage=coverage)
    return replace(answer, verdict=verdict)


def look_again(off_mm: float, *reasons: Reason) -> tuple[TrackedFrame, Found]:
    """A doubted answer at the true pose, after a start that was so far off."""
    tracker, found, frame, answer = found_at_the_truth()
    doubted = doubt(answer, 0.1, *reasons)
    frame = replace(frame, start=frame.start.move((off_mm, 0, 0, 0, 0, 0), (0.0, 0.0, 0.0)))
    (best,) = FirstRegistration(tracker)._look_again(frame, [doubted], GOAL)
    return best, found


@pytest.mark.parametrize("off_mm", [0.0, 20.0])
def test_a_rough_start_does_not_count_against_what_is_seen_then(off_mm: float) -> None:
    best, found = look_again(off_mm, Reason.COVERAGE_LOW)
    assert found.n_asked == 1
    assert best.verdict.status is Status.OK
    assert Reason.JUMPED not in best.verdict.reasons


def test_one_of_several_poses_is_not_made_sure_by_a_second_look() -> None:
    best, found = look_again(0.0, Reason.AMBIGUOUS)
    assert found.n_asked == 0
    assert best.verdict.reasons == (Reason.AMBIGUOUS,)


def test_what_surely_saw_another_size_is_not_overturned_by_a_second_look() -> None:
    best, found = look_again(0.0, Reason.SIZE_DIFFERS)
    assert found.n_asked == 0
    assert best.verdict.reasons == (Reason.SIZE_DIFFERS,)


@pytest.mark.parametrize(
    ("said_before", "is_found"),
    few_rows_of(
        [(Reason.AMBIGUOUS, False), (Reason.COVERAGE_LOW, True), (Reason.SIZE_DIFFERS, False)]
    ),
)
def test_what_the_search_for_a_buried_bone_finds_is_looked_at_again(
    said_before: Reason, is_found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The right pose of a glossy bone may be found by it alone, unless it was doubted before."""
    tracker, _, frame, answer = found_at_the_truth()
    registration = FirstRegistration(tracker)
    first, buried = doubt(answer, 0.1, said_before), doubt(answer, 0.5, Reason.SURFACE_MISFIT)
    monkeypatch.setattr(registration, "_judge_distinct", lambda *_: [first])
    monkeypatch.setattr(registration, "_look_again", only_once(registration._look_again))
    monkeypatch.setattr(registration, "_judge_buried", lambda *_: buried)
    best, *_ = registration._register_around(frame, GOAL)
    assert (best.verdict.status is Status.OK) is is_found


def only_once(look_again):
    """Looks again at answers that the search for a buried bone gave, and at no earlier ones."""

    def look(frame, answers, goal):
        is_last = Reason.SURFACE_MISFIT in answers[0].verdict.reasons
        return look_again(frame, answers, goal) if is_last else answers

    return look


@pytest.mark.parametrize("is_glossy", [False, True])
def test_after_a_second_look_the_next_frame_begins_with_it(
    is_glossy: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    a = room()
    picture = a.frames[0]
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.highlights = found = Found(tracker)
    begun: list[int] = []
    grey = tracker.near.find
    monkeypatch.setattr(tracker.near, "find", lambda frame: begun.append(1) or grey(frame))
    state = TrackState.at_rest(a.truth(picture), picture.captured_ns)
    state = replace(state, is_glossy=is_glossy)
    tracked, after = tracker.track(picture, state, GOAL)
    assert tracked.verdict.status is Status.OK
    assert (len(begun), found.n_asked) == ((0, 1) if is_glossy else (1, 0))
    assert after.is_glossy is tracked.is_matte is is_glossy


def test_a_bone_on_which_nothing_mirrored_is_seen_is_followed_as_usual() -> None:
    a = room()
    picture = a.frames[0]
    grey = replace(picture, left=picture.left[..., 1].copy(), right=picture.right[..., 1].copy())
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    state = TrackState.at_rest(a.truth(picture), picture.captured_ns)
    state = replace(state, is_glossy=True)
    tracked, after = tracker.track(grey, state, GOAL)
    assert tracked.verdict.status is Status.OK
    assert not after.is_glossy


def test_behind_a_hand_what_is_seen_without_highlights_does_not_count(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    a = room()
    picture = a.frames[0]
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.highlights = found = Found(tracker)
    monkeypatch.setattr(bimcc_tracker, "is_little_occluded", lambda _: False)
    state = TrackState.at_rest(a.truth(picture), picture.captured_ns)
    state = replace(state, is_glossy=True)
    tracked, _ = tracker.track(picture, state, GOAL)
    assert found.n_asked == 1
    assert not tracked.is_matte


@pytest.mark.parametrize(("spread_ratio", "is_replaced"), [(0.9, True), (0.1, False)])
def test_an_ok_answer_is_replaced_by_one_that_fits_better_alone(
    spread_ratio: float, is_replaced: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    tracker, _, frame, answer = found_at_the_truth()
    monkeypatch.setattr(bimcc_tracker, "is_worth_a_second_look", lambda _: True)
    assert answer.verdict.status is Status.OK
    loose = replace(answer, verdict=replace(answer.verdict, spread_ratio=spread_ratio))
    assert tracker.look_again(frame, loose, GOAL).is_matte is is_replaced
