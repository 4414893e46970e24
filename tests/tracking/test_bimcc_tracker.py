"""One bone followed from frame to frame by the production tracker."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from navapp.geometry.rig import RigQuality
from navapp.registration import solution_at
from navapp.tracking import TrackState
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.first_registration import FirstRegistration
from navapp.tracking.frame import FREE_SETTINGS, Fit
from navapp.tracking.judging import PoseJudge
from navapp.tracking.row_times import RowTimes
from navapp.tracking.search.near import NearSearch
from navapp.tracking.surface_meter import WIDE_BOX
from navapp.values import FrameTimings, Prior, Reason, Status, TrackedFrame, Verdict
from tests.many import few_of, few_rows_of
from tests.pictures import Pictures
from tests.tracking.meters import Listening
from tests.tracking.rooms import GOAL, Room, room


def follow(a: Room, tracker: BimccTracker, start_off=(0.0,) * 6):
    """Track through the room's frames, from a pose a little beside the first truth."""
    truth = a.truth(a.frames[0])
    start = truth.move(start_off, truth.apply(tracker.model.centre_mm))
    state = TrackState.at_rest(start, a.frames[0].captured_ns)
    answers = []
    for frame in a.frames:
        tracked, state = tracker.track(frame, state, GOAL)
        answers.append((frame, tracked))
    return answers, state


@pytest.mark.parametrize("motion", few_of(["still", "patient"]))
@pytest.mark.slow
def test_a_knee_is_followed(motion: str) -> None:
    a = room(motion)
    answers, state = follow(a, a.tracker, (1.5, -1.0, 2.0, 0.01, -0.015, 0.01))
    for frame, tracked in answers:
        assert tracked.verdict.status is Status.OK
        assert a.error_mm(tracked.left_from_bone, frame) < 1.2
        assert tracked.estimate.covariance.shape == (6, 6)
        assert tracked.left_from_bone.target == "left"
    assert state.n_lost == 0


def test_following_twice_gives_the_same_bits() -> None:
    a = room()
    first, second = follow(a, a.tracker)[0], follow(a, a.tracker)[0]
    for (_, one), (_, other) in zip(first, second, strict=True):
        assert one.left_from_bone.matrix.tobytes() == other.left_from_bone.matrix.tobytes()


@pytest.mark.slow
def test_grey_pictures_do_as_well() -> None:
    a = room(is_grey=True, n_frames=2)
    assert a.frames[0].left.ndim == 2
    for frame, tracked in follow(a, a.tracker)[0]:
        assert a.error_mm(tracked.left_from_bone, frame) < 1.2


@pytest.mark.parametrize(("shape", "level"), [((720, 1280), 0), ((720, 1280, 3), 255)])
def test_pictures_without_content_are_lost(shape, level: int) -> None:
    a = room()
    flat = Pictures(*np.full((2, *shape), level, dtype=np.uint8), 66_000_000)
    state = TrackState.at_rest(a.truth(a.frames[0]), 0)
    tracked, after = a.tracker.track(flat, state, GOAL)
    assert tracked.verdict.status is Status.LOST
    assert tracked.verdict.reasons
    assert tracked.left_from_bone is None
    assert after.left_from_bone is state.left_from_bone
    found = a.tracker.register(flat, a.prior, GOAL)
    assert all(one.verdict.status is Status.LOST for one in found)
    assessed = a.tracker.assess(flat, state.left_from_bone, GOAL)
    assert assessed.verdict.status is Status.LOST


@pytest.mark.parametrize("eye", ["left", "right"])
def test_one_dark_eye_is_lost(eye: str) -> None:
    a = room()
    frame = a.frames[0]
    dark = replace(frame, **{eye: np.zeros_like(frame.left)})
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    tracked, _ = a.tracker.track(dark, state, GOAL)
    assert tracked.verdict.status is Status.LOST


@pytest.mark.parametrize("shift", [(900.0, 0.0, 0.0), (0.0, -700.0, 0.0), (0.0, 0.0, -1500.0)])
def test_a_bone_out_of_view_is_lost_and_said_so(shift) -> None:
    a = room()
    frame = a.frames[0]
    away = a.truth(frame).move((*shift, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    state = TrackState.at_rest(away, frame.captured_ns)
    tracked, after = a.tracker.track(frame, state, GOAL)
    assert tracked.verdict.status is Status.LOST
    assert tracked.verdict.reasons == (Reason.OUT_OF_VIEW,)
    assert after.n_lost == 1
    assessed = a.tracker.assess(frame, away, GOAL)
    assert assessed.verdict.reasons == (Reason.OUT_OF_VIEW,)
    found = a.tracker.register(frame, Prior({"femur": away}), GOAL)
    assert [f.verdict.status for f in found] == [Status.LOST]


def test_a_pose_is_assessed_where_it_stands() -> None:
    a = room()
    frame = a.frames[0]
    truth = a.truth(frame)
    right = a.tracker.assess(frame, truth, GOAL)
    assert right.verdict.status is not Status.LOST
    np.testing.assert_allclose(right.left_from_bone.matrix, truth.matrix, atol=1e-9)
    turned = truth.move((0, 0, 0, 0, np.radians(15.0), 0), truth.apply(a.tracker.model.centre_mm))
    wrong = a.tracker.assess(frame, turned, GOAL)
    assert wrong.verdict.status is Status.LOST


def test_a_rig_that_was_not_accepted_never_gives_ok() -> None:
    a = room()
    rig = replace(a.rig, quality=RigQuality(False, ("too few pictures",)))
    for _, tracked in follow(a, BimccTracker(rig, a.tracker.model.bone))[0]:
        assert tracked.verdict.status is not Status.OK
        assert Reason.RIG_NOT_ACCEPTED in tracked.verdict.reasons


def lost_far_away(a: Room, n_seen: int = 2) -> TrackState:
    """Of a bone that was followed, then expected 70 mm from where it is, and lost."""
    truth = a.truth(a.frames[0])
    state = TrackState.at_rest(truth, a.frames[0].captured_ns)
    for frame in a.frames[:n_seen]:
        _, state = a.tracker.track(frame, state, GOAL)
    away = truth.move((70.0, 0, 0, 0, 0, 0), truth.apply(a.tracker.model.centre_mm))
    return replace(state, left_from_bone=away, n_lost=4)


def test_the_box_leads_back_to_a_lost_bone() -> None:
    a = room()
    state, frame = lost_far_away(a), a.frames[2]
    found, after = a.tracker.track(frame, state, GOAL)
    assert a.error_mm(found.left_from_bone, frame) < 1.2
    # So far from where it was expected, it has to be confirmed by the next frame.
    assert found.verdict.reasons == (Reason.JUMPED,)
    assert after.n_lost == 0
    later = replace(frame, captured_ns=frame.captured_ns + 66_000_000)
    again, _ = a.tracker.track(later, after, GOAL)
    assert again.verdict.status is Status.OK
    boxless = replace(state, box=None)
    found, _ = a.tracker.track(frame, boxless, GOAL)
    assert found.verdict.status is not Status.OK


class Never:
    """Stands for what must not be asked for anything; a part of it may be."""

    def __init__(self, **asked) -> None:
        self.__dict__.update(asked)

    def __getattr__(self, name: str):
        return lambda *given, **more: pytest.fail(name)


def never_searching(near: NearSearch) -> BimccTracker:
    """A tracker that fails when it looks for more than where the model rests."""
    a = room()
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.near = Never(find_on_model=near.find_on_model)
    tracker.buried = tracker.after_loss = tracker.diagnosis = Never()
    return tracker


def glance(a: Room, state: TrackState, tracker: BimccTracker | None = None):
    frame, tracker = a.frames[2], tracker or a.tracker
    return tracker.glance(frame, state, GOAL)


@pytest.mark.parametrize("n_lost", [0, 1, 5, 10])
def test_a_glance_does_not_look_further_off(n_lost: int) -> None:
    a = room()
    state = replace(lost_far_away(a), n_lost=n_lost, cause=Reason.OTHER_SIDE)
    found, after = glance(a, state, never_searching(a.tracker.near))
    assert found.verdict.status is Status.LOST
    assert found.verdict.reasons[0] is Reason.OTHER_SIDE
    assert (after.n_lost, after.cause) == (n_lost + 1, Reason.OTHER_SIDE)
    assert after.left_from_bone is state.left_from_bone
    # Nor is the box followed.
    assert after.box is state.box


def test_a_frame_that_is_tracked_asks_for_all_that_a_glance_does_not() -> None:
    """So that the test above would notice."""
    a = room()
    state, frame = lost_far_away(a), a.frames[2]
    with pytest.raises(pytest.fail.Exception):
        never_searching(a.tracker.near).track(frame, state, GOAL)


@pytest.mark.parametrize(
    ("n_lost", "searches"),
    few_rows_of([(1, [3, 0]), (2, [3, 0]), (3, []), (4, [3, 0]), (5, [])], 2),
)
def test_a_lost_bone_is_looked_for_in_every_frame_and_searched_in_some(
    n_lost: int, searches: list[int]
) -> None:
    a, asked = room(), []
    state, picture = replace(lost_far_away(a), n_lost=n_lost, n_searches=3), a.frames[2]
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.after_loss = SimpleNamespace(find=lambda _, n_searches: asked.append(n_searches) or [])
    _, after = tracker.track(picture, state, GOAL)
    # Where its box lies, which may go further off, and where it was expected.
    assert asked == searches
    assert after.n_searches == (4 if searches else 3)
    near = replace(state, left_from_bone=a.truth(picture))
    found, after = tracker.track(picture, near, GOAL)
    assert found.verdict.status is Status.OK
    assert after.n_lost == after.n_searches == 0


def test_a_doubted_place_ends_no_loss_before_the_bone_was_searched_elsewhere() -> None:
    a, asked = room(), []
    tracker = doubting_tracker(a)
    tracker.after_loss = SimpleNamespace(find=lambda *given: asked.append(given) or [])
    picture = a.frames[2]
    state = replace(TrackState.at_rest(a.truth(picture), 0), n_lost=3)
    assert tracker.track(picture, state, GOAL)[0].verdict.reasons == (Reason.SURFACE_MISFIT,)
    assert len(asked) == 1


@pytest.mark.parametrize("n_lost", [3, 4, 5])
def test_in_every_lost_frame_a_dark_picture_is_the_first_reason(n_lost: int) -> None:
    a, picture = room(), room().frames[2]
    state = replace(TrackState.at_rest(a.truth(picture), 0), n_lost=n_lost)
    black = np.zeros_like(picture.left)
    tracked, _ = a.tracker.track(replace(picture, left=black, right=black), state, GOAL)
    assert tracked.verdict.status is Status.LOST
    assert tracked.verdict.reasons[0] is Reason.PICTURE_DARK


@pytest.mark.parametrize("n_lost", [0, 5])
def test_a_glance_finds_a_bone_near_where_it_is_expected(n_lost: int) -> None:
    a = room()
    truth = a.truth(a.frames[2])
    expected = truth.move(
        (2.0, -1.5, 2.0, 0.01, -0.01, 0.01), truth.apply(a.tracker.model.centre_mm)
    )
    found, after = glance(a, replace(TrackState.at_rest(expected, 0), n_lost=n_lost))
    assert found.verdict.status is Status.OK
    assert a.error_mm(found.left_from_bone, a.frames[2]) < 0.4
    assert after.n_lost == 0
    assert after.box is not None


class Doubting(PoseJudge):
    """Doubts the place of every pose."""

    def judge(self, *given) -> TrackedFrame:
        tracked = super().judge(*given)
        return replace(tracked, verdict=Verdict(Status.DEGRADED, 0.5, (Reason.SURFACE_MISFIT,)))


def doubting_tracker(a: Room) -> BimccTracker:
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.judge = Doubting(a.tracker.meter, tracker.settings)
    return tracker


def test_a_doubt_at_a_glance_puts_off_no_search() -> None:
    a = room()
    tracker = doubting_tracker(a)
    state = replace(TrackState.at_rest(a.truth(a.frames[2]), 0), n_doubted=4)
    found, after = glance(a, state, tracker)
    assert found.verdict.reasons == (Reason.SURFACE_MISFIT,)
    assert after.is_search_due
    assert not state.update(found, 0, tracker.model.centre_mm).is_search_due


@pytest.mark.parametrize(
    ("n_doubted", "is_due"), [(0, False), (1, True), (2, True), (3, False), (5, False)]
)
def test_a_doubted_place_is_compared_with_others_ever_more_rarely(
    n_doubted: int, is_due: bool
) -> None:
    a, taken = room(), []
    tracker = doubting_tracker(a)
    tracker.highlights = SimpleNamespace(find=lambda *given: [])
    tracker.buried = SimpleNamespace(find=lambda frame: taken.append("buried") or [])
    near = tracker.near.find

    def find(frame):
        for fit in near(frame):
            taken.append("near")
            yield fit

    tracker.near.find = find
    picture = a.frames[2]
    state = replace(TrackState.at_rest(a.truth(picture), 0), n_doubted=n_doubted)
    tracker.track(picture, state, GOAL)
    assert taken == (["near", "near", "buried"] if is_due else ["near"])


def test_the_box_of_a_pose_is_its_projection() -> None:
    a = room()
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    tracked, state = a.tracker.track(frame, state, GOAL)
    mesh = a.tracker.model.bone.mesh
    pixels = a.rig.left.project(tracked.left_from_bone.apply(mesh.vertices_mm))
    box = state.box.picture_box
    np.testing.assert_allclose([box.x, box.y], pixels.min(axis=0), atol=0.5)
    np.testing.assert_allclose([box.width, box.height], np.ptp(pixels, axis=0), atol=0.5)


def test_the_time_of_a_frame_is_told_part_by_part() -> None:
    a = room()
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    tracked, _ = a.tracker.track(frame, state, GOAL)
    timings = tracked.timings
    parts = (
        timings.rectify_ms, timings.stereo_ms, timings.estimate_ms, timings.judge_ms,
        timings.fill_ms,
    )  # fmt: skip
    assert min(parts) > 0.0
    # What the helper filled beside them costs the frame no time.
    assert timings.total_ms == pytest.approx(sum(parts))


class EqualAnswers:
    """A judge that gives answers of equal worth."""

    def __init__(self, meter, reason: Reason = Reason.COVERAGE_LOW) -> None:
        self.meter, self.reason, self.answers, self.fits = meter, reason, [], []

    def judge(self, frame, fit, goal):
        self.fits.append(fit)
        verdict = Verdict(Status.DEGRADED, 1.0, (self.reason,), coverage=0.3)
        self.answers.append(TrackedFrame("femur", None, verdict, FrameTimings()))
        return self.answers[-1]


def test_of_equal_answers_the_last_stands() -> None:
    a = room()
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.judge = judge = EqualAnswers(a.tracker.meter)
    frame = tracker.begin(a.frames[0], a.truth(a.frames[0]))
    assert tracker.judge_fits(frame, ["near", "free"], GOAL) is judge.answers[1]


def test_what_a_search_for_a_buried_bone_finds_takes_no_place_of_an_equal_answer() -> None:
    a = room()
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.judge = judge = EqualAnswers(a.tracker.meter, Reason.SURFACE_MISFIT)
    tracker.near = SimpleNamespace(find=lambda frame: ["near"])
    tracker.buried = SimpleNamespace(find=lambda frame: ["buried"])
    tracker.highlights = SimpleNamespace(find=lambda *given: [])
    state = replace(TrackState.at_rest(a.truth(a.frames[0]), 0), n_doubted=1)
    frame = tracker.begin_predicted(a.frames[0], state)
    assert tracker._follow(frame, state, GOAL) is judge.answers[0]
    assert judge.fits == ["near", "buried"]


def test_a_frame_that_is_begun_again_keeps_what_was_predicted() -> None:
    """Else a jump would not be noticed: for rows of another motion, and for a bone searched."""
    a = room()
    tracker, begun = BimccTracker(a.rig, a.tracker.model.bone), []
    whole = tracker.begin
    tracker.begin = lambda *given, **more: begun.append(whole(*given, **more)) or begun[-1]
    state = TrackState.at_rest(a.truth(a.frames[0]), 0)
    frame = replace(a.frames[0], captured_ns=33_000_000)
    first = tracker.begin_predicted(frame, state)
    times = SimpleNamespace(
        with_motion_to=lambda pose: None if pose is None else RowTimes.of_pair(
            tracker.meter, state, replace(frame, skew_ns=1)
        )
    )  # fmt: skip
    answer = tracker._follow(first, state, GOAL)
    tracker.follow_closer(
        replace(first, times=times), answer, lambda again: tracker._follow(again, state, GOAL)
    )
    away = a.truth(a.frames[0]).move((4.0, 0, 0, 0, 0, 0), (0.0, 0.0, 0.0))
    tracker._search_places(first, [away], 0, GOAL, tracker.judge.lost_in(first))
    assert len(begun) == 3
    assert all(one.predicted is first.predicted for one in begun[1:])


def test_the_answer_with_the_motion_that_the_pose_shows_counts_even_when_it_is_worse() -> None:
    a = room()
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    state = TrackState.at_rest(a.truth(a.frames[0]), 0)
    frame = replace(a.frames[0], captured_ns=33_000_000)
    first = tracker.begin_predicted(frame, state)
    answer = tracker._follow(first, state, GOAL)
    assert answer.verdict.status is Status.OK
    lost = tracker.judge.lost_in(first)
    for other, is_kept in ((None, True), (RowTimes.of_pair, False)):
        found = other and other(tracker.meter, state, replace(frame, skew_ns=1))
        times = SimpleNamespace(with_motion_to=lambda pose, found=found: found)
        closer = tracker.follow_closer(replace(first, times=times), answer, lambda again: lost)
        assert closer is (answer if is_kept else lost)


def test_candidates_that_share_a_free_measurement_are_checked_each_at_its_own_pose() -> None:
    """The range of depths that is looked through, and what hides the bone, follow the pose."""
    a = room()
    frame, truth = a.frames[0], a.truth(a.frames[0])
    meter = Listening(a.tracker.meter, "measure_coarsely")
    tracker = BimccTracker(a.rig, a.tracker.model.bone)
    tracker.judge = PoseJudge(meter, tracker.settings)
    view = tracker.begin(frame, truth)
    measured = tracker.meter.measure_freely(view.pair, view.start, WIDE_BOX)
    away = view.start.move((0.0, 0.0, 25.0, 0.2, 0.0, 0.0), view.start.translation_mm)
    fits = [
        Fit(solution_at(measured.scene, tracker.model, pose, FREE_SETTINGS).estimate, measured)
        for pose in (view.start, away)
    ]
    FirstRegistration(tracker)._judge_distinct(view, fits, GOAL)
    assert {id(pose) for _, pose, *_ in meter.given} == {id(fit.pose) for fit in fits}


def test_a_lost_pose_places_no_box() -> None:
    """The judge tells the pose of a lost bone as well."""
    a = room()
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    found, before = a.tracker.track(frame, state, GOAL)
    lost = replace(found, verdict=replace(found.verdict, status=Status.LOST))
    later = a.tracker.begin(replace(a.frames[2], captured_ns=66_000_000), a.truth(a.frames[2]))
    _, after = a.tracker.update(lost, before, later)
    assert after.box is before.box
    _, after = a.tracker.update(found, before, later)
    assert after.box is not before.box
