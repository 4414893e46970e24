"""Which corner is aligned next, and where the board is wanted."""

import dataclasses

import numpy as np
import pytest

from calibration.mirror.alignments import solve_alignments
from navapp.control.mirror_alignment.board_place import locate_board
from navapp.control.mirror_alignment.guidance import Goal, Guide, Known
from navapp.control.mirror_alignment.kept_crosses import KeptCross, KeptCrosses
from tests.calibration.marks import BOARD
from tests.control.mirror_alignment.rooms import MIDDLE_MM, MirrorRoom

FLIPS = (True, False)


@pytest.fixture
def room() -> MirrorRoom:
    return MirrorRoom(noise_px=0.0)


def place_in(room):
    place = locate_board(room.look(room.read(0.1)), BOARD, room.rig)
    assert place is not None
    return place


def kept_at(room, heights_mm, n=4, spread=1.0) -> KeptCrosses:
    """Alignments of that many corners at heights of the board along the line of sight.

    With a smaller spread the corners are nearer to the board's middle than they truly are.
    """
    kept, ahead = KeptCrosses(), room.setup.site_mm - room.setup.eye_mm
    ahead = ahead / np.linalg.norm(ahead)
    for height in heights_mm:
        for corner in (0, 9, 40, 69)[:n]:
            middle = room.pose.apply(MIDDLE_MM) + height * ahead
            point = middle + spread * (room.point_mm(corner) + height * ahead - middle)
            pixel = np.rint(room.true.project(point[None])[0]).astype(int)
            kept.add(KeptCross(corner, (int(pixel[0]), int(pixel[1])), point, 0.1, middle))
    return kept


def guide_in(room) -> Guide:
    return Guide(room.display_told, BOARD, room.rig)


def known(room, kept) -> Known:
    solved = room.solve_as()(room.display_told, kept.alignments)
    flips = room.true.flips_columns, room.true.flips_rows
    return Known(kept, solved.model, solved, flips)


def test_the_first_corner_is_one_of_the_middle(room):
    place = place_in(room)
    corner = guide_in(room).choose(Known(KeptCrosses(), None, None, FLIPS), place)
    assert isinstance(corner, int)
    assert np.linalg.norm(BOARD.points_mm[corner] - MIDDLE_MM) < 12.0


def test_a_corner_is_not_asked_for_twice_at_one_height(room):
    kept, place = kept_at(room, [0.0], n=3), place_in(room)
    corner = guide_in(room).choose(Known(kept, None, None, FLIPS), place)
    assert isinstance(corner, int)
    assert corner not in (0, 9, 40)


def test_too_little_depth_asks_for_more_at_the_nearer_end(room):
    kept = kept_at(room, [0.0, 9.0, 18.0], spread=0.2)
    goal = guide_in(room).choose(known(room, kept), place_in(room))
    assert isinstance(goal, Goal)
    told = goal.tell(room.pose.apply(MIDDLE_MM))
    assert told.startswith("raise the board by")
    assert told.endswith("towards the eye")


def test_enough_depth_and_a_corner_that_helps_ask_for_no_move(room):
    kept = kept_at(room, [-40.0, 0.0, 40.0], n=2)
    chosen = guide_in(room).choose(known(room, kept), place_in(room))
    assert isinstance(chosen, int)


@pytest.mark.release
def test_a_board_that_lies_badly_is_wanted_elsewhere(room):
    """Aligned at the middle alone, with few marks in view: a place aside tells much more."""
    kept, place = kept_at(room, [-40.0, 0.0, 40.0], spread=0.3), place_in(room)
    found = solve_alignments(room.display_told, kept.alignments)
    solved = Known(kept, found.model, found, (found.model.flips_columns, found.model.flips_rows))
    few = np.isin(place.ids, (34, 35, 44, 45))
    place = dataclasses.replace(
        place, ids=place.ids[few], points_mm=place.points_mm[few], sds_mm=place.sds_mm[few]
    )
    guide = guide_in(room)
    goal = guide.choose(solved, place)
    assert isinstance(goal, Goal)
    assert not goal.is_reached(guide.middle_of(place))
    assert "third of the display)" in goal.tell(guide.middle_of(place))
    # One that cannot be had is not asked for again; another one at the same height is, after the
    # next cross.
    refused = [goal]
    while isinstance(refused[-1], Goal):
        guide.skip_goal(refused[-1])
        assert isinstance(guide.choose(solved, place), int)
        guide.forget_corners()
        refused.append(guide.choose(solved, place))
    refused.pop()
    heights = [one.height_mm for one in refused]
    assert len(set(heights)) < len(heights)
    middles = np.array([one.middle_mm for one in refused])
    apart_mm = np.linalg.norm(middles[:, None] - middles[None], axis=2)
    assert apart_mm[np.triu_indices(len(middles), 1)].min() > 19.0


@pytest.mark.parametrize(
    ("way", "said"),
    [
        ((0.0, 0.0, 30.0), "lower the board by 30 mm, away from the eye"),
        ((0.0, 0.0, -30.0), "raise the board by 30 mm, towards the eye"),
        ((-60.0, 0.0, 0.0), "move it 60 mm to the left as you see it"),
        ((60.0, -40.0, 0.0), "move it 60 mm to the right and 40 mm up as you see it"),
        ((0.0, 3.0, 2.0), "hold the board still"),
    ],
)
def test_the_way_is_said_as_the_eye_sees_it(way, said):
    goal = Goal(np.array(way), np.eye(3), is_of_height=False, height_mm=0.0, away_from="eye")
    assert goal.tell(np.zeros(3)) == said


def test_without_any_corner_nothing_is_chosen(room):
    guide, place = guide_in(room), place_in(room)
    for corner in range(len(BOARD.points_mm)):
        guide.skip_corner(corner)
    nothing = Known(KeptCrosses(), None, None, FLIPS)
    assert guide.choose(nothing, place) is None
    guide.forget_corners()
    assert guide.choose(nothing, place) is not None
