from dataclasses import replace

import numpy as np
import pytest

from drivers.frames import StereoFrame
from navapp.control.capture.board_view import BoardView
from navapp.control.capture.next_view import starting_view
from navapp.control.capture.shutter import Shutter, motion_px
from tests.calibration.marks import BOARD, drawn_rig, seen_pair

BLACK = np.zeros((2, 2), np.uint8)
POSE = starting_view(BOARD, 0, (350.0, 550.0))


def view(
    number: int, shift_px: float = 0.0, blur_px: float = 0.6, noise_px: float = 0.02
) -> BoardView:
    pair = seen_pair(0, drawn_rig(np.random.default_rng(1)), POSE, np.random.default_rng(number),
                     noise_px=noise_px)  # fmt: skip
    views = [
        replace(one, pixels=one.pixels + np.array([shift_px, 0.0]), blur_px=blur_px)
        for one in (pair.left, pair.right)
    ]
    now = number * 100_000_000
    return BoardView(StereoFrame(BLACK, BLACK, now, now, 0, number, "x"), *views)


def unmet(shutter: Shutter, one: BoardView, kept=()) -> list[str]:
    return [check.name for check in shutter.check(one, list(kept)) if not check.is_met]


def test_a_sharp_still_new_view_is_good():
    shutter = Shutter()
    assert unmet(shutter, view(0)) == ["still"]
    assert unmet(shutter, view(1)) == []


@pytest.mark.parametrize(("shift_px", "expected"), [(0.4, []), (0.7, ["still"])])
def test_motion_is_judged_by_its_speed(shift_px, expected):
    """5 px in a second are half a pixel in the tenth between two looks."""
    shutter = Shutter()
    shutter.check(view(0), [])
    assert unmet(shutter, view(1, shift_px)) == expected


def test_sharpness_is_judged_against_the_best_seen():
    shutter = Shutter()
    shutter.check(view(0, blur_px=0.6), [])
    assert unmet(shutter, view(1, blur_px=0.8)) == []
    assert unmet(shutter, view(2, blur_px=0.9)) == ["sharp"]


def test_the_same_view_again_is_not_new():
    shutter = Shutter()
    shutter.check(view(0), [])
    kept = [view(5).to_pair(0)]
    assert unmet(shutter, view(1), kept) == ["new"]
    shutter.check(view(2, 8.0), kept)
    assert unmet(shutter, view(3, 8.0), kept) == []


def test_a_board_that_one_camera_does_not_see_is_named():
    half = replace(view(0), right=None)
    (check,) = Shutter().check(half, [])
    assert (check.name, check.is_met) == ("seen", False)
    assert "right" in check.text
    assert half.to_pair(3) is None


def test_boards_with_too_few_common_marks_cannot_be_compared():
    one = view(0).left
    few = replace(one, ids=one.ids[:3], pixels=one.pixels[:3], sigma_px=one.sigma_px[:3])
    assert motion_px(one, few) is None
    assert motion_px(one, one) == 0.0
