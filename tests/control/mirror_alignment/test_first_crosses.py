"""Where a cross is lit before the display is solved."""

import numpy as np

from calibration.mirror.alignment_fit import Alignments
from navapp.control.mirror_alignment.first_crosses import (
    RIM_PX,
    guess_pixel,
    is_on_display,
    make_rough_model,
)
from tests.control.mirror_alignment.rooms import MirrorRoom


def seen(room: MirrorRoom, points_mm: np.ndarray) -> Alignments:
    return Alignments(room.true.project(points_mm), points_mm, np.full(len(points_mm), 0.1))


def grid(room: MirrorRoom, *heights_mm: float) -> np.ndarray:
    flat = np.array([[0, 0], [60, 0], [0, 45], [60, 45]], float) - (30, 22)
    return np.vstack(
        [room.setup.site_mm + np.column_stack([flat, np.full(4, h)]) for h in heights_mm]
    )


def test_none_one_and_three_alignments_tell_more_and_more():
    room = MirrorRoom()
    display, points = room.display_told, grid(room, 0.0)
    assert guess_pixel(display, seen(room, points[:0]), None, points[3]) == (960, 540)
    one = guess_pixel(display, seen(room, points[:1]), None, points[3])
    np.testing.assert_allclose(one, room.true.project(points[:1])[0], atol=0.6)
    three = guess_pixel(display, seen(room, points[:3]), None, points[3])
    assert np.linalg.norm(three - room.true.project(points[3:])[0]) < 25.0


def test_a_rough_model_needs_two_planes():
    room = MirrorRoom()
    display = room.display_told
    assert make_rough_model(display, seen(room, grid(room, 0.0))) is None
    flat = np.vstack([grid(room, 0.0), grid(room, 0.0) + np.array([9.0, 7.0, 0.0])])
    assert make_rough_model(display, seen(room, flat)) is None
    made = seen(room, grid(room, 0.0, 40.0))
    model = make_rough_model(display, made)
    assert model is not None
    assert (model.flips_columns, model.flips_rows) == (
        room.true.flips_columns, room.true.flips_rows,
    )  # fmt: skip
    elsewhere = grid(room, -40.0)
    guessed = [guess_pixel(display, made, model, point) for point in elsewhere]
    assert np.linalg.norm(guessed - room.true.project(elsewhere), axis=1).max() < 60.0


def test_a_cross_stays_on_the_display():
    room = MirrorRoom()
    points = grid(room, 0.0)
    far = points[0] + (2000.0, 0.0, 0.0)
    u, _ = guess_pixel(room.display_told, seen(room, points[:3]), None, far)
    assert u in (RIM_PX, room.display_told.width_px - 1 - RIM_PX)
    pixels = np.array([[100.0, 100.0], [5.0, 100.0], [np.nan, 100.0]])
    assert is_on_display(room.display_told, pixels).tolist() == [True, False, False]
