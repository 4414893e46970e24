"""Who confirms crosses without aligning them gets no display."""

import pytest

from navapp.control.commands import NudgeCross
from navapp.control.mirror_alignment.states import Confirm
from tests.control.mirror_alignment.careless import TOKEN_MOVES, confirm_blindly
from tests.control.mirror_alignment.rooms import MirrorRoom, align, alignment_in, steps, until_aimed
from tests.many import few_of


@pytest.mark.parametrize("seed", few_of(range(1, 7)))
@pytest.mark.parametrize("move", few_of(TOKEN_MOVES))
def test_a_refused_calibration_is_not_accepted_by_confirming_predictions(move, seed):
    ended = confirm_blindly(seed, 12, TOKEN_MOVES[move])
    assert not ended.is_false, ended
    assert not ended.is_accepted, ended


@pytest.mark.release
@pytest.mark.parametrize("seed", range(1, 4))
def test_who_never_aligns_a_cross_is_not_accepted(seed):
    ended = confirm_blindly(seed, 0, TOKEN_MOVES["token"])
    assert not ended.is_accepted, ended


def test_a_cross_that_was_not_moved_is_not_kept():
    room = MirrorRoom()
    session = alignment_in(room)
    for nothing in ([], [NudgeCross(0, 0)]):
        until_aimed(session)
        for command in nothing:
            session.submit(command)
        session.submit(Confirm())
        assert steps(session, 3).n_kept == 0
        assert "move the cross onto the corner first" in session.snapshot.events[-1]
    session.submit(NudgeCross(1, 0))
    session.submit(Confirm())
    assert steps(session, 2).n_kept == 1
    # The next one again.
    until_aimed(session)
    session.submit(Confirm())
    assert steps(session, 2).n_kept == 1


@pytest.mark.release
def test_a_cross_is_lit_beside_what_is_expected_and_each_room_beside_another():
    offsets = []
    for seed in (1, 2):
        room = MirrorRoom(seed)
        session = alignment_in(room)
        align(room, session, 12)
        until_aimed(session)
        for _ in range(3):
            asked = session.snapshot
            expected = session._solution.found.model.project(room.point_mm(asked.corner)[None])[0]
            offsets.append(asked.cross_px - expected)
            align(room, session)
            until_aimed(session)
    far_px = [float((one**2).sum() ** 0.5) for one in offsets]
    assert min(far_px) > 12.0
    assert max(far_px) < 43.0
    assert len({tuple(one.round()) for one in offsets}) == len(offsets)
