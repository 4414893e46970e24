from dataclasses import replace

import numpy as np
import pytest

from navapp.tracking.box_tracker import BoxState, followed, placed, reduced
from tests.tracking.pictures import BOX, box_at, empty, enlarged, scene

LARGE = BOX.resized(4.0)


def start() -> BoxState:
    return placed(None, enlarged(scene()), LARGE, hidden_share=0.4)


def right(state: BoxState, shift, scale: float = 1.0) -> bool:
    return state.picture_box.overlap(box_at(shift, scale).resized(4.0)) > 0.8


def test_a_pose_places_the_box() -> None:
    state = start()
    assert state.picture_box.overlap(LARGE) == pytest.approx(1.0)
    assert state.picture.shape == (180, 320)
    assert placed(state, enlarged(scene()), None, None).box is None


def test_colour_and_grey_give_the_same() -> None:
    picture = enlarged(scene())
    colour = np.repeat(picture[..., None], 3, axis=2)
    np.testing.assert_array_equal(reduced(colour), reduced(picture))


def test_a_box_is_followed_behind_a_hand_that_comes_and_goes() -> None:
    state = start()
    for number in range(24):
        shift = (3.0 * number, 10.0 * np.sin(number / 3.0))
        hidden = max(0.0, 0.5 - abs(number - 12) / 12.0)
        gain = 1.0 + 0.3 * np.sin(number / 4.0)
        picture = scene(shift, 1.0, gain, hidden, seed=number)
        state = followed(state, enlarged(picture))
        assert right(state, shift), number


def test_a_lost_box_is_none_until_it_is_back_elsewhere() -> None:
    state = start()
    for seed in range(3):
        state = followed(state, enlarged(empty(seed)))
        assert state.box is None
        assert state.picture_box is None
    state = followed(state, enlarged(scene((-80.0, 20.0), 1.1, seed=4)))
    assert right(state, (-80.0, 20.0), 1.1)


def test_dark_pictures_have_no_box() -> None:
    assert followed(start(), np.zeros((720, 1280), np.uint8)).box is None


def test_without_an_accepted_frame_nothing_is_claimed() -> None:
    state = placed(None, enlarged(scene()), LARGE, None)
    assert state.memory is None
    assert followed(state, enlarged(scene((2.0, 0.0), seed=1))).box is None


def test_following_teaches_nothing() -> None:
    state = start()
    after = state
    for number in range(5):
        after = followed(after, enlarged(scene((4.0 * number, 0.0), seed=number)))
    assert after.memory is state.memory
    assert after.n_accepted == state.n_accepted == 1


def test_every_so_many_accepted_frames_one_is_learned_from() -> None:
    state, learned_in = start(), []
    for number in range(1, 46):
        after = placed(state, enlarged(scene(seed=number)), LARGE, hidden_share=0.4)
        if after.memory is not state.memory:
            learned_in.append(number)
        state = after
    assert learned_in == [15, 30, 45]
    assert state.n_accepted == 46


def test_a_hand_over_the_bone_is_not_learned() -> None:
    state = replace(start(), n_accepted=15)
    hidden = enlarged(scene(hidden_share=0.4, seed=2))
    assert placed(state, hidden, LARGE, hidden_share=0.6).memory is state.memory
    assert placed(state, hidden, LARGE, hidden_share=0.45).memory is not state.memory


def test_other_pictures_than_before_are_searched_anew() -> None:
    other = enlarged(scene(seed=1))[:600]
    state = followed(start(), np.ascontiguousarray(other))
    assert state.picture.shape == (150, 320)
    assert right(state, (0.0, 0.0))
