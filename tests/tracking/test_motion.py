from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.tracking import TrackState
from navapp.tracking.box.picture_box import PictureBox
from navapp.tracking.box.tracker import BoxState
from navapp.tracking.motion import is_worth_a_search
from navapp.values import (
    FrameTimings,
    PoseEstimate,
    Reason,
    RowCheck,
    Status,
    TrackedFrame,
    Verdict,
)

CENTRE = np.array([3.0, -20.0, 15.0])
START = RigidTransform.from_parts(
    "left", "femur", rotation_from_vector((0.4, -0.2, 0.1)), (10.0, 5.0, 450.0)
)
PERIOD_NS = 66_000_000


def frame(pose: RigidTransform | None, status: Status = Status.OK) -> TrackedFrame:
    estimate = None
    if pose is not None:
        estimate = PoseEstimate(pose, np.eye(6), 500, 1.0, 0.2, 0.2, 3, True)
    return TrackedFrame("femur", estimate, Verdict(status), FrameTimings())


def moved(pose: RigidTransform, twist) -> RigidTransform:
    return pose.move(twist, pose.apply(CENTRE))


STEP = np.array([1.5, -0.5, 0.8, 0.01, -0.02, 0.005])


def test_a_bone_at_rest_is_expected_where_it_is() -> None:
    state = TrackState.at_rest(START, 1000)
    np.testing.assert_array_equal(state.predict(1000 + PERIOD_NS, CENTRE).matrix, START.matrix)


def test_a_steady_motion_goes_on_damped() -> None:
    state = TrackState.at_rest(START, 0).update(frame(moved(START, STEP)), PERIOD_NS, CENTRE)
    predicted = state.predict(2 * PERIOD_NS, CENTRE)
    expected = moved(moved(START, STEP), 0.7 * STEP)
    np.testing.assert_allclose(predicted.matrix, expected.matrix, atol=1e-9)
    np.testing.assert_allclose(state.velocity * PERIOD_NS / 1e9, STEP, atol=1e-9)


def test_what_is_carried_is_expected_where_it_was_carried_to() -> None:
    state = TrackState.at_rest(START, 0).update(frame(moved(START, STEP)), PERIOD_NS, CENTRE)
    turn = rotation_from_vector((0.0, 0.1, -0.2))
    motion = RigidTransform.from_parts("left", "left", turn, (4.0, -3.0, 2.0))
    carried = state.carry(motion)
    predicted = carried.predict(2 * PERIOD_NS, CENTRE)
    np.testing.assert_array_equal(predicted.matrix, (motion @ state.left_from_bone).matrix)
    assert (carried.captured_ns, carried.n_lost) == (state.captured_ns, state.n_lost)


def test_half_the_time_is_half_the_motion() -> None:
    state = TrackState.at_rest(START, 0).update(frame(moved(START, STEP)), PERIOD_NS, CENTRE)
    half = state.predict(PERIOD_NS + PERIOD_NS // 2, CENTRE)
    expected = moved(moved(START, STEP), 0.35 * STEP)
    np.testing.assert_allclose(half.matrix, expected.matrix, atol=1e-9)


@pytest.mark.parametrize(
    "lost", [frame(None, Status.LOST), frame(moved(START, 9 * STEP), Status.LOST)]
)
def test_a_loss_keeps_the_pose_and_forgets_the_velocity(lost: TrackedFrame) -> None:
    moving = TrackState.at_rest(START, 0).update(frame(moved(START, STEP)), PERIOD_NS, CENTRE)
    state = moving.update(lost, 2 * PERIOD_NS, CENTRE).update(lost, 3 * PERIOD_NS, CENTRE)
    assert state.n_lost == 2
    assert state.left_from_bone is moving.left_from_bone
    assert state.velocity is None


def test_a_refused_pose_is_followed_only_when_that_is_asked_for() -> None:
    refused = frame(moved(START, STEP), Status.LOST)
    state = TrackState.at_rest(START, 0)
    after = state.update(refused, PERIOD_NS, CENTRE, follows_refused=True)
    assert after.left_from_bone is refused.left_from_bone
    assert after.n_lost == 0
    np.testing.assert_allclose(after.velocity * PERIOD_NS / 1e9, STEP, atol=1e-9)
    without = state.update(frame(None, Status.LOST), PERIOD_NS, CENTRE, follows_refused=True)
    assert (without.left_from_bone, without.n_lost) == (START, 1)


def test_the_box_stays_through_poses_and_losses() -> None:
    box = BoxState(PictureBox(0.0, 0.0, 1.0, 1.0))
    state = replace(TrackState.at_rest(START, 0), box=box)
    assert state.update(frame(None, Status.LOST), PERIOD_NS, CENTRE).box is box
    assert state.update(frame(moved(START, STEP)), PERIOD_NS, CENTRE).box is box


def test_the_first_pose_after_a_loss_gives_no_velocity() -> None:
    state = TrackState.at_rest(START, 0).update(frame(None, Status.LOST), PERIOD_NS, CENTRE)
    state = state.update(frame(moved(START, STEP)), 2 * PERIOD_NS, CENTRE)
    assert state.n_lost == 0
    assert state.velocity is None
    assert state.captured_ns == 2 * PERIOD_NS


@pytest.mark.parametrize("elapsed_ns", [0, -PERIOD_NS, 500_000_000])
def test_a_gap_that_is_too_long_or_none_gives_no_velocity(elapsed_ns: int) -> None:
    state = TrackState.at_rest(START, 10**9)
    state = state.update(frame(moved(START, STEP)), 10**9 + elapsed_ns, CENTRE)
    assert state.velocity is None


def test_an_old_velocity_says_nothing_after_a_long_silence() -> None:
    """A camera that was away for seconds: the bone is looked for where it was last seen."""
    state = TrackState.at_rest(START, 0).update(frame(moved(START, STEP)), PERIOD_NS, CENTRE)
    predicted = state.predict(PERIOD_NS + 3_000_000_000, CENTRE)
    np.testing.assert_array_equal(predicted.matrix, state.left_from_bone.matrix)


def test_rotations_do_not_drift_over_a_thousand_updates() -> None:
    state = TrackState.at_rest(START, 0)
    for number in range(1, 1001):
        pose = state.predict(number * PERIOD_NS, CENTRE)
        nudge = STEP * np.sin(number / 7.0)
        state = state.update(frame(moved(pose, nudge)), number * PERIOD_NS, CENTRE)
    rotation = state.left_from_bone.rotation
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-11)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_the_twist_between_two_poses_moves_one_to_the_other() -> None:
    other = moved(START, 20.0 * STEP)
    twist = START.twist_to(other, CENTRE)
    np.testing.assert_allclose(moved(START, twist).matrix, other.matrix, atol=1e-9)


@pytest.mark.parametrize(
    ("reasons", "is_taken"),
    [
        ((Reason.JUMPED,), True),
        ((Reason.COVERAGE_LOW,), True),
        ((Reason.JUMPED, Reason.CARTILAGE_UNCERTAIN), True),
        ((Reason.JUMPED, Reason.COVERAGE_LOW), False),
        ((Reason.DEGENERATE, Reason.JUMPED), False),
    ],
)
def test_something_else_far_away_is_not_followed(
    reasons: tuple[Reason, ...], is_taken: bool
) -> None:
    far = moved(START, (20.0, 0.0, 0.0, 0.0, 0.2, 0.0))
    found = frame(far, Status.DEGRADED)
    found = replace(found, verdict=Verdict(Status.DEGRADED, 0.2, reasons))
    state = TrackState.at_rest(START, 0).update(found, PERIOD_NS, CENTRE)
    assert state.left_from_bone is (far if is_taken else START)
    assert state.n_lost == (0 if is_taken else 1)


def test_what_is_wrong_for_good_is_remembered_until_a_frame_is_ok() -> None:
    state = TrackState.at_rest(START, 0, Reason.OTHER_SIDE)
    for number, status in enumerate((Status.DEGRADED, Status.LOST), start=1):
        found = frame(START, status)
        found = replace(found, verdict=Verdict(status, 0.2, (Reason.SURFACE_MISFIT,)))
        state = state.update(found.with_cause(state.cause), number * PERIOD_NS, CENTRE)
        assert state.cause is Reason.OTHER_SIDE
    assert state.update(frame(START), 3 * PERIOD_NS, CENTRE).cause is None


def doubtful(pose: RigidTransform) -> TrackedFrame:
    return replace(frame(pose), verdict=Verdict(Status.DEGRADED, 1.0, (Reason.SURFACE_MISFIT,)))


def test_a_search_that_finds_nothing_is_made_ever_more_rarely() -> None:
    state, due = TrackState.at_rest(START, 0), []
    for number in range(33):
        if state.is_search_due:
            due.append(number)
        state = state.update(doubtful(START), PERIOD_NS * number, CENTRE)
    assert due == [1, 2, 4, 8, 16, 24, 32]


def test_a_lost_bone_is_searched_ever_more_rarely() -> None:
    state, due = TrackState.at_rest(START, 0), []
    for number in range(21):
        if state.is_search_after_loss_due:
            due.append(number)
        state = state.update(frame(START, Status.LOST), PERIOD_NS * number, CENTRE)
    assert due == [0, 1, 2, 4, 8, 12, 16, 20]


def test_after_a_sure_frame_a_single_doubt_is_not_searched_and_the_second_is() -> None:
    state = TrackState.at_rest(START, 0)
    for _ in range(3):
        state = state.update(doubtful(START), PERIOD_NS, CENTRE)
    assert not state.is_search_due
    state = state.update(frame(START), PERIOD_NS, CENTRE)
    assert not state.is_search_due
    assert state.update(doubtful(START), PERIOD_NS, CENTRE).is_search_due


@pytest.mark.parametrize(
    ("status", "reasons", "rows", "is_worth"),
    [
        (Status.OK, (), None, False),
        (Status.DEGRADED, (Reason.TRE_TOO_LARGE,), None, False),
        (Status.DEGRADED, (Reason.SURFACE_MISFIT,), None, True),
        (Status.DEGRADED, (Reason.SURFACE_MISFIT,), RowCheck(0.1, False), True),
        (Status.DEGRADED, (Reason.SURFACE_MISFIT,), RowCheck(0.5, True), False),
        (Status.LOST, (Reason.SURFACE_MISFIT,), RowCheck(0.5, True), True),
    ],
)
def test_a_search_is_made_where_it_could_mend_the_place(status, reasons, rows, is_worth) -> None:
    found = replace(frame(START), verdict=Verdict(status, 1.0, reasons), rows=rows)
    assert is_worth_a_search(found) is is_worth


def test_a_doubt_under_rows_that_disagree_puts_off_no_search() -> None:
    state, rows_off = TrackState.at_rest(START, 0), RowCheck(0.5, True)
    for number in range(3):
        found = replace(doubtful(START), rows=rows_off)
        state = state.update(found, number * PERIOD_NS, CENTRE)
    state = state.update(doubtful(START), 3 * PERIOD_NS, CENTRE)
    assert state.n_doubted == 1
    assert state.is_search_due


def test_a_lost_frame_neither_counts_as_a_doubt_nor_ends_a_row_of_them() -> None:
    state = TrackState.at_rest(START, 0)
    for number in range(3):
        state = state.update(doubtful(START), number * PERIOD_NS, CENTRE)
    lost = state.update(frame(START, Status.LOST), 3 * PERIOD_NS, CENTRE)
    assert (lost.n_doubted, lost.n_lost) == (3, 1)
    assert lost.update(doubtful(START), 4 * PERIOD_NS, CENTRE).n_doubted == 4


def test_what_was_carried_is_expected_there_and_its_velocity_is_known() -> None:
    state = TrackState.at_rest(START, 0)
    carried = state.carry(RigidTransform.from_parts("left", "left", np.eye(3), [3.0, 0.0, 0.0]))
    np.testing.assert_allclose(
        carried.predict(PERIOD_NS, CENTRE).translation_mm,
        START.translation_mm + np.array([3.0, 0.0, 0.0]),
    )
    velocity = carried.find_velocity(PERIOD_NS, CENTRE)
    np.testing.assert_allclose(velocity[:3] * PERIOD_NS / 1e9, [3.0, 0.0, 0.0], atol=1e-9)
    assert state.find_velocity(PERIOD_NS, CENTRE) is None


def test_a_jump_tells_no_velocity() -> None:
    jumped = replace(
        frame(moved(START, STEP)), verdict=Verdict(Status.DEGRADED, None, (Reason.JUMPED,))
    )
    assert TrackState.at_rest(START, 0).update(jumped, PERIOD_NS, CENTRE).velocity is None


def test_a_change_of_velocity_is_remembered_and_fades() -> None:
    state, pose = TrackState.at_rest(START, 0), START
    for number, twist in enumerate([0.0 * STEP, STEP, STEP, STEP], start=1):
        pose = moved(pose, twist)
        state = state.update(frame(pose), number * PERIOD_NS, CENTRE)
    expected = 0.8**2 * np.abs(STEP) / (PERIOD_NS / 1e9)
    np.testing.assert_allclose(state.velocity_change, expected, rtol=0.05)
