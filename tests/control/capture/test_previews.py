import numpy as np

from navapp.control.capture.next_view import plan_next_view, starting_view
from navapp.control.capture.previews import make_previews
from tests.calibration.marks import BOARD, HEIGHT, WIDTH
from tests.control.capture.rooms import DEPTH_MM, Room


def test_marks_and_the_wanted_view_are_drawn_where_they_are():
    room = Room()
    frame = room.read(0.1)
    next_view = plan_next_view(BOARD, [], (WIDTH, HEIGHT), DEPTH_MM)
    room.pose = starting_view(BOARD, 0, DEPTH_MM)
    plain = make_previews(BOARD, frame, None, None)
    assert [picture.shape for picture in plain] == [(108, 192, 3)] * 2
    assert not any(picture.any() for picture in plain)
    look = room.look(frame, BOARD)
    marked = make_previews(BOARD, frame, look, None)
    places = np.argwhere(marked[0][:, :, 1] > 200)[:, ::-1] * (WIDTH / 192)
    assert np.abs(places.min(axis=0) - look.left.pixels.min(axis=0)).max() < 15.0
    assert np.abs(places.max(axis=0) - look.left.pixels.max(axis=0)).max() < 15.0
    outlined, without = make_previews(BOARD, frame, None, next_view)
    # Where the right camera stands is not known before there is a rig.
    assert outlined.any()
    assert not without.any()
    lines = np.argwhere(outlined[:, :, 2] > 200)[:, ::-1]
    # The first view is in the middle of the left picture.
    assert np.abs(0.5 * (lines.min(axis=0) + lines.max(axis=0)) - (96, 54)).max() < 3.0


def test_nothing_is_shown_before_the_first_frame():
    assert make_previews(BOARD, None, None, None) is None
