from dataclasses import replace

import numpy as np
import pytest

from navapp.tracking.box.picture_box import PictureBox
from navapp.tracking.box.tracker import BoxState, BoxTracker, follow_box, place_box, reduce_picture
from navapp.values import FrameTimings, PoseEstimate, Status, TrackedFrame, Verdict
from tests.picture_boxes import overlap
from tests.tracking.box.pictures import BOX, box_at, clutter, empty, enlarged, scene, turned
from tests.tracking.rooms import room

LARGE = BOX.resize(4.0)


def start() -> BoxState:
    return place_box(None, enlarged(scene()), LARGE, hidden_fraction=0.4)


def right(state: BoxState, shift, scale: float = 1.0) -> bool:
    return overlap(state.picture_box, box_at(shift, scale).resize(4.0)) > 0.8


def test_a_pose_places_the_box() -> None:
    state = start()
    assert overlap(state.picture_box, LARGE) == pytest.approx(1.0)
    assert place_box(state, enlarged(scene()), None, None).box is None


def test_a_picture_is_reduced_to_the_same_from_colour_and_grey() -> None:
    picture = enlarged(scene())
    assert reduce_picture(picture).shape == (180, 320)
    colour = np.repeat(picture[..., None], 3, axis=2)
    np.testing.assert_array_equal(reduce_picture(colour), reduce_picture(picture))


def test_a_box_is_followed_behind_a_hand_that_comes_and_goes() -> None:
    state = start()
    for number in range(24):
        shift = (3.0 * number, 10.0 * np.sin(number / 3.0))
        hidden = max(0.0, 0.5 - abs(number - 12) / 12.0)
        gain = 1.0 + 0.3 * np.sin(number / 4.0)
        picture = scene(shift, 1.0, gain, hidden, seed=number)
        state = follow_box(state, enlarged(picture))
        assert right(state, shift), number


def test_a_lost_box_is_none_until_it_is_back_elsewhere() -> None:
    state = start()
    for seed in range(3):
        state = follow_box(state, enlarged(empty(seed)))
        assert state.box is None
        assert state.picture_box is None
    state = follow_box(state, enlarged(scene((-80.0, 20.0), 1.1, seed=4)))
    assert right(state, (-80.0, 20.0), 1.1)


@pytest.mark.parametrize("turn_deg", [-20.0, 20.0])
def test_a_lost_box_is_found_where_the_bone_has_turned(turn_deg: float) -> None:
    state = follow_box(start(), enlarged(empty()))
    assert state.box is None
    shift = (-40.0, 12.0)
    state = follow_box(state, enlarged(turned(scene(shift, seed=4), box_at(shift), turn_deg)))
    assert right(state, shift)


def test_a_jump_is_followed() -> None:
    state = follow_box(start(), enlarged(scene((70.0, 25.0), seed=1)))
    assert right(state, (70.0, 25.0))


@pytest.mark.parametrize("seed", range(4))
def test_another_pattern_or_a_hand_over_all_has_no_box(seed: int) -> None:
    for picture in (clutter(4.0, 25.0, 70 + seed), scene(hidden_fraction=1.0, seed=seed)):
        assert follow_box(start(), enlarged(picture)).box is None


def test_a_box_is_none_as_soon_as_its_middle_is_out_of_view() -> None:
    state = start()
    for number, column in enumerate((-100.0, -106.0, -112.0, -118.0, -124.0, -130.0, -136.0)):
        state = follow_box(state, enlarged(scene((column, 0.0), seed=number)))
        np.testing.assert_allclose(state.box.centre, box_at((column, 0.0)).centre, atol=4.0)
    for number, column in enumerate((-142.0, -148.0, -154.0, -160.0, -166.0)):
        state = follow_box(state, enlarged(scene((column, 0.0), seed=number)))
    assert state.box is None


def test_a_box_out_of_view_is_not_seen_in_what_goes_on_beyond_the_rim() -> None:
    """Stripes look the same wherever a box lies along them."""
    stripes = np.repeat(clutter(4.0, 25.0, 1)[:, :1], 320, axis=1)
    state = place_box(None, enlarged(stripes), LARGE, hidden_fraction=0.4)
    state = follow_box(replace(state, box=box_at((-162.0, 0.0))), enlarged(stripes))
    assert state.box.centre[0] > 0.0


def test_dark_pictures_have_no_box() -> None:
    assert follow_box(start(), np.zeros((720, 1280), np.uint8)).box is None


def test_without_an_accepted_frame_nothing_is_claimed() -> None:
    state = place_box(None, enlarged(scene()), LARGE, None)
    assert state.templates is None
    assert follow_box(state, enlarged(scene((2.0, 0.0), seed=1))).box is None


def test_following_teaches_nothing() -> None:
    state = start()
    after = state
    for number in range(5):
        after = follow_box(after, enlarged(scene((4.0 * number, 0.0), seed=number)))
    assert after.templates is state.templates
    assert after.n_accepted == state.n_accepted == 1


def test_every_so_many_accepted_frames_one_is_learned_from() -> None:
    state, learned_in = start(), []
    for number in range(1, 46):
        picture = enlarged(clutter(3.0, 30.0, number))
        after = place_box(state, picture, LARGE, hidden_fraction=0.4)
        if after.templates is not state.templates:
            learned_in.append(number)
        state = after
    assert learned_in == [15, 30, 45]
    assert state.n_accepted == 46


def test_a_hand_over_the_bone_is_not_learned() -> None:
    state = replace(start(), n_accepted=15)
    hidden = enlarged(scene(hidden_fraction=0.4, seed=2))
    assert place_box(state, hidden, LARGE, hidden_fraction=0.6).templates is state.templates
    assert place_box(state, hidden, LARGE, hidden_fraction=0.45).templates is not state.templates


def test_pictures_may_become_smaller() -> None:
    smaller = np.ascontiguousarray(enlarged(scene(seed=1))[:600])
    assert right(follow_box(start(), smaller), (0.0, 0.0))


# --- a box and a pose ---------------------------------------------------------------------------


def boxes() -> BoxTracker:
    a = room()
    return BoxTracker(a.rig, a.tracker.model)


@pytest.mark.parametrize("shift", [(60.0, -20.0, 0.0), (-90.0, 25.0, 0.0), (30.0, 10.0, -120.0)])
def test_a_box_moves_the_pose_to_where_it_was_made(shift) -> None:
    """Depth follows the size of the box only when it changed clearly."""
    a = room()
    truth = a.truth(a.frames[0])
    centre_mm = truth.apply(a.tracker.model.centre_mm)
    elsewhere = truth.move((*shift, 0, 0, 0), centre_mm)
    found = boxes().move(truth, boxes().project(elsewhere))
    off_mm = found.apply(a.tracker.model.centre_mm) - elsewhere.apply(a.tracker.model.centre_mm)
    np.testing.assert_allclose(off_mm[:2], 0.0, atol=4.0)
    assert abs(off_mm[2]) < 20.0
    np.testing.assert_array_equal(found.rotation, truth.rotation)
    assert found.name == truth.name


def test_a_box_a_few_percent_larger_leaves_the_depth() -> None:
    a = room()
    truth = a.truth(a.frames[0])
    box = boxes().project(truth).move(np.array([40.0, 0.0]), 1.06)
    found = boxes().move(truth, box)
    assert found.translation_mm[2] == pytest.approx(truth.translation_mm[2], abs=2.0)
    assert found.translation_mm[0] - truth.translation_mm[0] == pytest.approx(13.0, abs=2.0)


def test_a_search_starts_from_the_box_and_from_where_it_was() -> None:
    truth = room().truth(room().frames[0])
    box = boxes().project(truth)
    assert boxes().starts(truth, None) == [truth]
    assert boxes().starts(truth, BoxState(None)) == [truth]
    assert boxes().starts(truth, BoxState(box.resize(0.25))) == [truth]
    far = box.move(np.array([200.0, 0.0]))
    first, second = boxes().starts(truth, BoxState(far.resize(0.25)))
    assert second is truth
    assert overlap(boxes().project(first), far) > 0.9


def test_only_an_ok_frame_teaches() -> None:
    a = room()
    truth, left = a.truth(a.frames[0]), a.frames[0].left
    estimate = PoseEstimate(truth, np.eye(6), 500, 1.0, 0.2, 0.2, 3, True)
    ok = TrackedFrame("femur", estimate, Verdict(Status.OK), FrameTimings())
    doubted = replace(ok, verdict=Verdict(Status.DEGRADED))
    lost = replace(ok, estimate=None, verdict=Verdict(Status.LOST))
    assert boxes().place(None, left, ok).templates is not None
    state = boxes().place(None, left, doubted)
    assert state.templates is None
    assert isinstance(state.box, PictureBox)
    assert boxes().place(state, left, lost) is state


def test_a_pose_behind_the_camera_has_no_box() -> None:
    truth = room().truth(room().frames[0])
    behind = truth.move((0, 0, -2000.0, 0, 0, 0), np.zeros(3))
    assert boxes().project(behind) is None
