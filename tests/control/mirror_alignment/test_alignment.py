"""The alignment of crosses, step by step, with a board in a simulated hand."""

import dataclasses

import numpy as np
import pytest

from calibration.mirror.alignments import count_depths, solve_alignments
from navapp.control.commands import NudgeCross
from navapp.control.mirror_alignment.states import (
    AlignmentPhase,
    Another,
    Confirm,
    Follow,
    Leave,
    MoveHand,
    Save,
    TurnArrows,
    Undo,
)
from navapp.errors import DeviceLost, InputError
from tests.calibration.marks import BOARD
from tests.control.mirror_alignment.rooms import (
    MIDDLE_MM,
    MirrorRoom,
    align,
    alignment_in,
    steps,
    until_aimed,
)


@pytest.fixture
def room() -> MirrorRoom:
    return MirrorRoom()


def told(session) -> str:
    return " | ".join(session.snapshot.events)


def lit(room: MirrorRoom) -> np.ndarray:
    """(2,) middle of what is lit; fails when the display is dark."""
    rows, columns = np.nonzero(room.display.visible_image()[:, :, 1])
    return 0.5 * np.array([columns.min() + columns.max(), rows.min() + rows.max()])


def test_the_first_cross_lies_near_the_middle_of_the_display(room):
    session = alignment_in(room)
    asked = until_aimed(session)
    assert asked.phase is AlignmentPhase.ALIGNING
    assert 14.0 < np.linalg.norm(lit(room) - (959.5, 539.5)) < 41.0
    row, column = asked.row_column
    assert asked.corner == (row - 1) * (BOARD.columns - 1) + column - 1
    assert f"row {row}, column {column}" in asked.instruction
    assert "right eye alone" in asked.instruction


def test_the_cross_goes_as_the_eye_sees_it(room):
    session = alignment_in(room)
    first = until_aimed(session)
    flips = np.array(first.flips)
    assert flips.sum() == 1
    session.submit(NudgeCross(10, 4))
    steps(session)
    moved = np.where(flips, -1, 1) * (10, 4)
    np.testing.assert_allclose(lit(room), np.array(first.cross_px) + moved)
    session.submit(TurnArrows(columns=True))
    session.submit(NudgeCross(10, 0))
    steps(session)
    np.testing.assert_allclose(lit(room), np.array(first.cross_px) + moved * (0, 1))


def test_arrows_that_were_exchanged_tell_how_the_display_is_read(room):
    session = alignment_in(room)
    until_aimed(session)
    before = session.made[0].reads_upside_down
    session.submit(TurnArrows(rows=True))
    steps(session)
    assert session.made[0].reads_upside_down is not before
    assert session.snapshot.flips[1] is not before


def test_what_is_confirmed_is_kept_with_its_place(room):
    session = alignment_in(room)
    asked = until_aimed(session)
    assert asked.corner is not None
    align(room, session)
    _, made = session.made
    aim = room.eye.aim_px(room.point_mm(asked.corner), 0)
    assert np.abs(made.pixels[0] - aim).max() <= 0.5
    assert np.linalg.norm(made.points_mm[0] - room.point_mm(asked.corner)) < 0.4
    assert 0.03 < made.points_sd_mm[0] < 0.3
    assert session.snapshot.used.sum() == 1


def test_a_board_that_moved_while_aligning_is_refused_once(room):
    session = alignment_in(room)
    until_aimed(session)
    session.submit(NudgeCross(1, 0))
    steps(session)
    room.nudge((0.0, 1.0, 0.0), (0.0, 0.0, 0.0))
    session.submit(Confirm())
    assert steps(session).n_kept == 0
    assert "the board has moved by 1.0 mm, look again" in told(session)
    # The operator looks again, and finds it right.
    steps(session, 2)
    session.submit(Confirm())
    assert steps(session, 2).n_kept == 1


def test_a_cross_that_was_moved_after_the_board_is_kept(room):
    session = alignment_in(room)
    until_aimed(session)
    room.nudge((0.0, 1.0, 0.0), (0.0, 0.0, 0.0))
    steps(session, 2)
    align(room, session)
    assert session.snapshot.n_kept == 1


def test_a_board_that_is_hidden_is_refused(room):
    session = alignment_in(room)
    asked = until_aimed(session)
    session.submit(NudgeCross(1, 0))
    steps(session)
    room.hidden_corners = {asked.corner}
    session.submit(Confirm())
    assert "hold still" in steps(session).instruction
    assert steps(session, 9).n_kept == 0
    assert "the corner is not seen by both cameras" in told(session)
    room.is_hidden = True
    session.submit(Confirm())
    assert steps(session, 9).n_kept == 0
    assert "the board is not seen by both cameras" in told(session)


def test_a_corner_that_one_picture_missed_is_waited_for(room):
    session = alignment_in(room)
    asked = until_aimed(session)
    session.submit(NudgeCross(1, 0))
    steps(session)
    room.hidden_corners = {asked.corner}
    session.submit(Confirm())
    steps(session, 2)
    room.hidden_corners = set()
    assert steps(session).n_kept == 1


def test_a_board_that_is_carried_away_gets_another_corner(room):
    session = alignment_in(room)
    until_aimed(session)
    session.submit(MoveHand((30.0, 0.0, 0.0)))
    steps(session)
    steps(session, 2)
    assert "another corner is chosen" in told(session)
    assert until_aimed(session).corner is not None


def test_a_corner_that_cannot_be_had_is_left_out(room):
    session = alignment_in(room)
    first = until_aimed(session).corner
    session.submit(Another())
    steps(session)
    assert until_aimed(session).corner != first


def test_the_last_one_can_be_undone(room):
    session = alignment_in(room)
    align(room, session, 2)
    session.submit(Undo())
    steps(session)
    assert session.snapshot.n_kept == 1
    session.submit(Undo())
    session.submit(Undo())
    assert steps(session).n_kept == 0


def test_four_at_a_height_then_the_board_is_wanted_lower(room):
    session = alignment_in(room, has_hand=False)
    align(room, session, 4)
    asked = steps(session, 3)
    assert asked.phase is AlignmentPhase.MOVING
    assert asked.cross_px is None
    assert not room.display.visible_image().any()
    assert asked.instruction.startswith("lower the board by 40 mm, away from the cameras")
    room.nudge((0.0, 0.0, 25.0), (0.0, 0.0, 0.0))
    assert steps(session, 3).instruction.startswith("lower the board by 15 mm")
    room.nudge((0.0, 0.0, 15.0), (0.0, 0.0, 0.0))
    assert until_aimed(session).n_depths == 1


def test_a_height_that_cannot_be_had_is_left_out(room):
    session = alignment_in(room, has_hand=False)
    align(room, session, 4)
    steps(session, 3)
    session.submit(Another())
    assert steps(session, 2).instruction.startswith("raise the board by 40 mm, towards the cameras")


def test_a_hand_that_follows_is_soon_done(room):
    session = alignment_in(room)
    done = align(room, session, 12)
    steps(session)
    assert session.snapshot.is_accepted
    assert done.n_depths >= 3
    assert done.range_mm >= 60.0
    session.submit(Save())
    assert steps(session).is_over
    display, made = session.made
    assert len(made.pixels) == 12
    assert display.reads_upside_down is room.setup.reads_upside_down


def test_a_hand_that_is_let_go_stays(room):
    session = alignment_in(room)
    session.submit(Follow(is_on=False))
    align(room, session, 4)
    before = room.pose
    steps(session, 3)
    assert room.pose is before


def test_crosses_are_soon_lit_near_their_corners(room):
    session = alignment_in(room)
    far_px = []
    for _ in range(11):
        asked = until_aimed(session)
        aim = room.eye.aim_px(room.point_mm(asked.corner), asked.n_kept)
        far_px.append(np.linalg.norm(aim - asked.cross_px))
        align(room, session)
    assert max(far_px[6:]) < 90.0
    assert np.median(far_px[8:]) < 30.0


def test_what_is_not_accepted_is_not_saved_and_goes_on(room):
    session = alignment_in(room, solve=room.solve_as("too few depths"))
    align(room, session, 12)
    session.submit(Save())
    assert not steps(session, 2).is_over
    assert "it is not accepted yet" in told(session)
    align(room, session)
    assert session.snapshot.n_kept == 13


def test_a_stray_is_told(room):
    session = alignment_in(room, solve=room.solve_as(strays=(3,)))
    align(room, session, 12)
    steps(session)
    assert "alignment 4 does not agree, it is left out: row" in told(session)
    assert session.snapshot.verdict.strays == (3,)


def test_leaving_asks_once_more_while_alignments_would_be_lost(room):
    session = alignment_in(room)
    align(room, session)
    session.submit(Leave())
    assert not steps(session).is_over
    assert "1 alignments make no display: leave again to end without one" in told(session)
    assert session.snapshot.instruction == session.snapshot.events[-1]
    session.submit(Leave())
    assert steps(session).is_over


@pytest.mark.parametrize("n", [0, 1])
def test_leaving_ends_at_once_when_nothing_is_lost(room, n):
    session = alignment_in(room, keeps_few=True)
    align(room, session, n)
    session.submit(Leave())
    assert steps(session).is_over


def test_a_lost_camera_is_said_and_the_display_is_dark(room, monkeypatch):
    session = alignment_in(room, reopen=lambda: room)
    align(room, session)
    read = room.read

    def lost(timeout_s):
        raise DeviceLost("the camera was unplugged")

    monkeypatch.setattr(room, "read", lost)
    assert "the camera was unplugged" in steps(session).trouble
    assert not room.display.visible_image().any()
    monkeypatch.setattr(room, "read", read)
    room.clock.advance_ns(5_000_000_000)
    assert steps(session, 2).trouble == ""
    align(room, session)
    assert session.snapshot.n_kept == 2


def test_the_cross_goes_out_by_itself(room):
    until_aimed(alignment_in(room))
    lit(room)
    room.clock.advance_ns(600_000_000)
    assert not room.display.visible_image().any()


def test_the_display_is_dark_when_it_is_closed(room):
    session = alignment_in(room)
    until_aimed(session)
    session.close()
    assert room.is_closed
    assert not room.display.visible_image().any()


def test_a_corner_that_a_turn_of_the_board_moved_is_not_kept():
    """The rim moves by more than the middle."""
    room = MirrorRoom(noise_px=0.0)
    session = alignment_in(room)
    align(room, session)
    asked = until_aimed(session)
    session.submit(NudgeCross(1, 0))
    steps(session)
    before = room.point_mm(asked.corner)
    room.nudge((0.0, 0.0, 0.0), (0.0, 0.0, 0.0074))
    moved_mm = np.linalg.norm(room.point_mm(asked.corner) - before)
    assert moved_mm > 0.4
    assert abs(steps(session, 3).moved_mm - moved_mm) < 0.1
    session.submit(Confirm())
    assert steps(session, 3).n_kept == 1
    assert f"the board has moved by {moved_mm:.1f} mm" in told(session)


@pytest.mark.parametrize("turned", [TurnArrows(columns=True), TurnArrows(rows=True)])
def test_arrows_are_not_exchanged_once_the_display_is_solved(room, turned):
    session = alignment_in(room)
    align(room, session, 12)
    before, display = steps(session).flips, session.made[0]
    session.submit(turned)
    assert steps(session).flips == before
    assert session.made[0] == display
    assert session.snapshot.events[-1] == "the arrows stay: the display is solved with them"
    assert session.snapshot.events[-2] == "u to fewer than 12 frees them, or begin anew"
    # With one cross less it is not solved any more.
    session.submit(Undo())
    session.submit(turned)
    assert steps(session).flips != before


def test_how_the_eye_reads_the_display_is_told(room):
    session = alignment_in(room)
    until_aimed(session)
    is_upside_down = session.snapshot.is_upside_down
    session.submit(TurnArrows(rows=True))
    assert steps(session).is_upside_down is not is_upside_down
    words = "upright" if is_upside_down else "on its head"
    assert f"arrows exchanged; the eye reads text {words}" in told(session)


def test_depths_are_counted_as_the_verdict_counts_them(room):
    session = alignment_in(room, solve=room.solve_as("too few depths", strays=(8, 9, 10, 11)))
    align(room, session, 12)
    told_at = steps(session)
    assert session._solution.found is not None
    used = session.made[1].points_mm[:8]
    n_depths, range_mm = count_depths(used, session._solution.found.model.eye_mm)
    assert (told_at.n_depths, told_at.range_mm) == (n_depths, pytest.approx(range_mm))
    whole_mm = count_depths(session.made[1].points_mm, session._solution.found.model.eye_mm)[1]
    assert whole_mm > range_mm + 10.0


def test_all_that_was_made_is_handed_over_after_every_change(room):
    stored = []
    session = alignment_in(room, store=lambda display, made: stored.append((display, made)))
    align(room, session, 3)
    session.submit(Undo())
    session.submit(TurnArrows(rows=True))
    steps(session)
    assert [len(made.pixels) for _, made in stored] == [1, 2, 3, 2, 2]
    assert stored[-1][0].reads_upside_down is not stored[0][0].reads_upside_down


def test_alignments_that_cannot_be_written_are_told_and_not_lost(room):
    def full(display, made):
        raise InputError("the disk is full")

    session = alignment_in(room, store=full)
    align(room, session, 2)
    assert "the disk is full" in told(session)
    assert len(session.made[1].pixels) == 2


def test_leaving_asks_before_a_display_is_replaced(room):
    session = alignment_in(room, replaces="display.yml")
    align(room, session, 12)
    session.submit(Leave())
    assert not steps(session, 2).is_over
    asked = session.snapshot.instruction
    assert asked == "display.yml will be replaced: leave again, or ctrl+c keeps it"
    # What else is done takes the question back.
    session.submit(NudgeCross(1, 0))
    session.submit(Leave())
    assert not steps(session).is_over
    session.submit(Leave())
    assert steps(session).is_over


def test_events_are_counted_beyond_those_that_are_kept(room):
    session = alignment_in(room)
    until_aimed(session)
    for _ in range(50):
        session.submit(TurnArrows(rows=True))
    snapshot = steps(session)
    assert snapshot.n_events == 50
    assert len(snapshot.events) == 30


def test_two_refused_ends_of_the_depth_are_asked_for_again(room):
    """Without more depth nothing would ever be accepted."""

    def flat(display, made):
        return room.solve_as("too few depths", strays=tuple(range(1, len(made.pixels))))(
            display, made
        )

    session = alignment_in(room, solve=flat)
    align(room, session, 11)
    session.submit(Follow(is_on=False))
    align(room, session)
    for _ in range(2):
        assert steps(session, 4).phase is AlignmentPhase.MOVING
        session.submit(Another())
    assert steps(session, 4).phase is AlignmentPhase.ALIGNING
    align(room, session)
    assert steps(session, 4).phase is AlignmentPhase.MOVING


@pytest.mark.release
@pytest.mark.parametrize("seed", [11, 12, 13])
def test_the_board_stays_around_its_first_place(seed):
    """However many crosses are asked for."""
    room = MirrorRoom(seed)

    def never(display, made):
        found = solve_alignments(display, made)
        quality = dataclasses.replace(found.model.quality, is_accepted=False, reasons=("x",))
        return dataclasses.replace(found, model=dataclasses.replace(found.model, quality=quality))

    session = alignment_in(room, solve=never)
    align(room, session)
    first_mm, ahead = room.pose.apply(MIDDLE_MM), room.setup.site_mm - room.setup.eye_mm
    ahead /= np.linalg.norm(ahead)
    for _ in range(24):
        align(room, session)
        way = room.pose.apply(MIDDLE_MM) - first_mm
        assert np.linalg.norm(way - (way @ ahead) * ahead) < 75.0
        assert np.linalg.norm(way) < 110.0
