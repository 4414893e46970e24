"""A guided capture on projected marks: when it keeps, what it asks for, when it stops."""

import numpy as np
import pytest

from navapp.control.capture.board_view import BoardView
from navapp.control.capture.next_view import starting_view
from navapp.control.capture.states import (
    Another,
    CapturePhase,
    DropLast,
    Finish,
    Follow,
    Leave,
    Nudge,
    Outcome,
    Take,
)
from navapp.errors import DeviceLost, InputError, ResultError
from navapp.geometry.transform import RigidTransform
from tests.calibration.marks import BOARD
from tests.control.capture.rooms import DEPTH_MM, Room, capture_in, steps
from tests.control.fakes import SlowExecutor


@pytest.fixture
def room() -> Room:
    return Room()


def at_start(room: Room, aside_mm: float = 0.0) -> None:
    pose = starting_view(BOARD, 0, DEPTH_MM).matrix.copy()
    pose[0, 3] += aside_mm
    room.pose = RigidTransform("left", "board", pose)


def followed(capture, until, most: int = 400):
    capture.submit(Follow(is_on=True))
    for _ in range(most):
        snapshot = capture.step()
        if until(snapshot):
            return snapshot
    raise AssertionError(f"not after {most} frames: {capture.snapshot}")


def test_a_board_that_is_held_still_where_it_is_wanted_is_kept_once(room):
    capture = capture_in(room)
    at_start(room)
    assert steps(capture, 1).n_kept == 0  # nothing is known of its motion yet
    assert steps(capture, 6).n_kept == 1
    assert list(room.kept) == [0]


def test_a_board_elsewhere_or_in_motion_is_not_kept(room):
    capture = capture_in(room)
    at_start(room, aside_mm=120.0)
    snapshot = steps(capture, 4)
    assert snapshot.n_kept == 0
    assert "mm to the left" in snapshot.instruction
    for k in range(6):
        at_start(room, aside_mm=2.0 * (-1) ** k)
        snapshot = capture.step()
    assert snapshot.n_kept == 0
    assert [check.name for check in snapshot.checks if not check.is_met] == ["still"]


def test_it_asks_for_the_board_while_a_camera_does_not_see_it(room):
    snapshot = steps(capture_in(room), 2)
    assert snapshot.n_seen[:2] == (0, 0)
    assert "show the board" in snapshot.instruction


def test_space_keeps_what_is_seen_wherever_it_is(room):
    capture = capture_in(room)
    capture.submit(Take())
    assert "not seen by both" in steps(capture, 1).events[-1]
    at_start(room, aside_mm=60.0)
    capture.submit(Take())
    assert steps(capture, 1).n_kept == 1


def test_the_last_pair_is_dropped_with_its_pictures_and_its_number(room):
    capture = capture_in(room)
    for aside in (0.0, 60.0):
        at_start(room, aside)
        capture.submit(Take())
        steps(capture, 1)
    capture.submit(DropLast())
    assert steps(capture, 1).n_kept == 1
    assert list(room.kept) == [0]
    capture.submit(Take())
    steps(capture, 1)
    assert list(room.kept) == [0, 2]


def test_a_hand_that_follows_brings_the_error_below_the_limit(room):
    capture = capture_in(room, stop_mm=0.4)
    snapshot = followed(capture, lambda s: s.is_enough)
    assert 8 <= snapshot.n_kept <= 20
    assert snapshot.bound_mm <= 0.4 <= snapshot.worst_mm or snapshot.worst_mm <= 0.4
    assert snapshot.covered.mean() > 0.4
    n_kept = snapshot.n_kept
    assert steps(capture, 20).n_kept == n_kept  # the shutter rests
    assert "enough" in capture.snapshot.instruction


def test_it_is_enough_with_the_pairs_that_were_asked_for(room):
    capture = capture_in(room, n_pairs=5)
    assert followed(capture, lambda s: s.is_enough).n_kept == 5


@pytest.mark.release
def test_a_pair_that_does_not_fit_is_named_and_left_out(room):
    capture = capture_in(room, stop_mm=0.01)
    followed(capture, lambda s: s.n_kept == 8)
    look = room.look

    def torn(frame, board):
        found = look(frame, board)
        room.pose = room.pose.move((6.0, 2.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 450.0))
        other = look(frame, board)
        return type(found)(frame, found.left, other.right)

    room.look = torn
    capture.submit(Follow(is_on=False))
    capture.submit(Take())
    snapshot = steps(capture, 2)
    assert snapshot.n_kept == 9
    assert any("pair 8 does not count" in text for text in snapshot.events)


def test_finish_solves_with_what_is_kept_and_tells(room):
    given = []

    def solve(pairs, report):
        report(0.5)
        given.extend(pairs)
        return Outcome(True, ("well",))

    capture = capture_in(room, solve, n_pairs=4)
    capture.submit(Finish())
    assert "too few" in steps(capture, 1).events[-1]
    followed(capture, lambda s: s.is_enough)
    capture.submit(Finish())
    snapshot = steps(capture, 1)
    assert [pair.index for pair in given] == [0, 1, 2, 3]
    assert snapshot.outcome == Outcome(True, ("well",))


def test_a_rig_that_is_refused_asks_for_more_pairs(room):
    def solve(pairs, report):
        raise ResultError("no rig explains these views", remedy="look at the pictures")

    capture = capture_in(room, solve, n_pairs=4)
    followed(capture, lambda s: s.is_enough)
    capture.submit(Finish())
    snapshot = steps(capture, 1)
    assert not snapshot.outcome.is_accepted
    assert "no rig explains" in snapshot.outcome.sentences[0]
    assert not snapshot.is_enough
    assert followed(capture, lambda s: s.is_enough).n_kept == 8


@pytest.mark.release
def test_a_view_that_cannot_be_had_is_not_asked_for_again(room):
    capture = capture_in(room, stop_mm=0.3)
    followed(capture, lambda s: s.n_kept == 6)
    look, tilts_deg = room.look, []

    def only_flat(frame, board):
        tilts_deg.append(np.degrees(np.arccos(room.pose.rotation[2, 2])))
        return look(frame, board) if tilts_deg[-1] < 20.0 else BoardView(frame, None, None)

    room.look = only_flat
    snapshot = followed(capture, lambda s: s.n_kept == 8, most=900)
    assert max(tilts_deg) > 30.0
    assert snapshot.n_kept == 8


def test_n_asks_for_another_view(room):
    capture = capture_in(room)
    at_start(room, aside_mm=150.0)
    first = steps(capture, 2).instruction
    capture.submit(Another())
    assert steps(capture, 2).instruction != first


def test_keys_move_the_hand_and_end_the_following(room):
    capture = capture_in(room)
    capture.submit(Follow(is_on=True))
    assert steps(capture, 1).is_following
    capture.submit(Nudge(shift_mm=(20.0, 0.0, 0.0)))
    assert not steps(capture, 1).is_following
    assert room.nudges == [((20.0, 0.0, 0.0), (0.0, 0.0, 0.0))]


def test_leaving_ends_it_and_closing_closes_the_camera(room):
    capture = capture_in(room)
    capture.submit(Leave())
    assert steps(capture, 1).phase is CapturePhase.OVER
    capture.close()
    assert room.is_closed


def test_a_full_disk_ends_the_capture_in_a_sentence(room, monkeypatch):
    capture = capture_in(room)
    at_start(room)

    def full(index, frame):
        raise InputError("folder x cannot be written (No space left on device)")

    monkeypatch.setattr(room, "keep", full)
    capture.submit(Take())
    with pytest.raises(InputError, match="No space"):
        steps(capture, 1)
    assert np.size(list(room.kept)) == 0


def lose_camera(room, capture) -> None:
    """The camera is gone, and cannot be opened."""
    read = room.read

    def gone(*_):
        room.clock.advance_ns(100_000_000)
        raise DeviceLost("the camera was unplugged")

    room.read = room.open = gone
    capture.step()

    def plug_in() -> None:
        room.read, room.open = read, lambda: None

    room.plug_in = plug_in


def reopening(room, executor=None):
    def reopen():
        room.open()
        return room

    room.open = lambda: None
    return capture_in(room, reopen=reopen, executor=executor)


def test_a_lost_camera_is_said_waited_for_and_everything_kept_stays(room):
    capture = reopening(room)
    at_start(room)
    before = steps(capture, 6)
    assert before.n_kept == 1
    assert before.trouble == ""
    lose_camera(room, capture)
    capture.submit(Take())
    lost = steps(capture, 40)
    assert lost.trouble.startswith("the camera was unplugged")
    assert lost.pictures is None
    assert lost.checks == ()
    assert lost.n_kept == 1
    assert sum("unplugged" in text for text in lost.events) == 1
    room.plug_in()
    while capture.step().trouble:
        assert room.clock.now_ns() < 60 * 10**9
    back = steps(capture, 6)
    assert back.trouble == ""
    assert back.pictures is not None
    assert "camera sim:room is back" in back.events
    # Where it was held before, the board is not wanted again; nothing was taken unasked.
    assert back.n_kept == 1
    assert list(room.kept) == [0]
    snapshot = followed(capture, lambda s: s.n_kept == 4)
    assert list(room.kept) == [0, 1, 2, 3]
    assert snapshot.phase is CapturePhase.CAPTURING


def test_a_board_is_not_called_still_by_what_was_seen_before_the_loss(room):
    capture = reopening(room)
    at_start(room, aside_mm=60.0)
    steps(capture, 4)
    lose_camera(room, capture)
    room.plug_in()
    while capture.snapshot.trouble:
        capture.step()
    first = next(s for s in (capture.step() for _ in range(9)) if s.checks)
    assert not next(check for check in first.checks if check.name == "still").is_met


def test_a_picture_from_before_the_loss_is_not_kept_after_it(room):
    executor = SlowExecutor()
    capture = reopening(room, executor)
    at_start(room)
    capture.step()
    assert executor.held
    n_before = room.n_frames
    lose_camera(room, capture)
    room.plug_in()
    while capture.snapshot.trouble:
        capture.step()
    capture.submit(Take())
    while not room.kept:
        executor.let_go()
        capture.step()
    assert all(sequence > n_before for sequence in room.kept.values())


def test_the_loss_of_a_camera_that_nobody_opens_again_is_the_end(room):
    capture = capture_in(room)
    steps(capture, 2)
    with pytest.raises(DeviceLost, match="unplugged"):
        lose_camera(room, capture)
