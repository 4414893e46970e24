"""Where the board's corners are, and whether it rests."""

import numpy as np
import pytest

from navapp.control.mirror_alignment.board_place import BoardLooks, locate_board
from tests.calibration.marks import BOARD
from tests.control.mirror_alignment.rooms import MirrorRoom


@pytest.fixture
def room() -> MirrorRoom:
    return MirrorRoom(noise_px=0.05)


def place_in(room):
    return locate_board(room.look(room.read(0.1)), BOARD, room.rig)


def test_corners_are_triangulated_with_their_errors(room):
    place = place_in(room)
    off_mm = place.points_mm - room.pose.apply(BOARD.points_mm[place.ids])
    rms_mm = float(np.sqrt((off_mm**2).mean()))
    assert 0.5 * rms_mm < np.median(place.sds_mm) < 2.0 * rms_mm
    assert np.abs(place.left_from_board.rotation - room.pose.rotation).max() < 2e-3


def test_a_board_that_one_camera_misses_is_nowhere(room):
    room.is_hidden = True
    assert place_in(room) is None
    room.is_hidden, room.hidden_corners = False, set(range(5, 70))
    assert place_in(room) is None


def test_it_rests_after_two_looks_and_not_while_it_moves(room):
    looks = BoardLooks()
    looks.add(place_in(room))
    assert not looks.is_still
    looks.add(place_in(room))
    assert looks.is_still
    room.nudge((2.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    looks.add(place_in(room))
    assert not looks.is_still
    looks.add(None)
    assert looks.newest is None


def test_a_pause_begins_anew(room):
    looks = BoardLooks()
    looks.add(place_in(room))
    room.clock.advance_ns(10_000_000_000)
    looks.add(place_in(room))
    assert not looks.is_still


def test_the_mean_of_looks_is_nearer_than_one(room):
    corner, off_mm, one_mm = 20, [], []
    for _ in range(20):
        looks = BoardLooks()
        for _ in range(5):
            looks.add(place_in(room))
        point, _ = looks.average(corner, 0)
        off_mm.append(np.linalg.norm(point - room.point_mm(corner)))
        one_mm.append(np.linalg.norm(looks.newest.point_of(corner) - room.point_mm(corner)))
    assert np.mean(off_mm) < 0.7 * np.mean(one_mm)
    assert looks.average(500, 0) is None


def test_steady_are_corners_that_every_look_shows(room):
    looks = BoardLooks()
    looks.add(place_in(room))
    room.hidden_corners = {3}
    looks.add(place_in(room))
    room.hidden_corners = {4}
    looks.add(place_in(room))
    assert not set(looks.steady.ids) & {3, 4}
    assert set(looks.newest.ids) & {3, 4} == {3}
