"""What is drawn by a display model is seen where it belongs, upright, by rays of their own."""

import cv2
import numpy as np
import pytest

from navapp.devices.simulated_mirror import true_display
from sim_devices.mirror_setups import draw_setup, look_at_site, make_eye_camera
from sim_devices.mirror_view import MirrorView
from tests.many import few_of

LETTER_MM = 12.0


def seed_with(flips: tuple[bool, bool]) -> int:
    """The first set-up that the eye must have flipped so."""
    for seed in range(100):
        model = true_display(draw_setup(np.random.default_rng(seed)))
        if (model.flips_columns, model.flips_rows) == flips:
            return seed
    raise AssertionError("no such set-up")


def strokes() -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Of an F, mm from its middle; x right, y down."""
    return [((-3.0, -6.0), (-3.0, 6.0)), ((-3.0, -6.0), (4.0, -6.0)), ((-3.0, 0.0), (2.0, 0.0))]


def expected(view: MirrorView, corners: np.ndarray) -> np.ndarray:
    """The letter as ink on the site would be seen, drawn by the true rays to its strokes."""
    picture = np.zeros((view.camera.height, view.camera.width), np.uint8)
    for first, last in corners:
        ends = np.rint(16 * view.site_px(np.stack([first, last]))).astype(int)
        cv2.line(picture, *map(tuple, ends.tolist()), 255, 6, cv2.LINE_AA, 4)
    return picture


@pytest.mark.parametrize("flips", few_of([(c, r) for c in (True, False) for r in (True, False)], 4))
def test_an_f_is_read_as_an_f_at_its_place(flips: tuple[bool, bool]) -> None:
    setup = draw_setup(np.random.default_rng(seed_with(flips)))
    pose = look_at_site(setup)
    eye_view = true_display(setup).view()
    right, below = pose.rotation[0], pose.rotation[1]
    corners = np.array(
        [[setup.site_mm + x * right + y * below for x, y in stroke] for stroke in strokes()]
    )
    drawn = np.zeros((1080, 1920), np.uint8)
    for first, last in corners:
        ends = eye_view.camera.project(eye_view.warp(np.stack([first, last])))
        cv2.line(
            drawn, *map(tuple, np.rint(16 * ends).astype(int).tolist()), 255, 3, cv2.LINE_AA, 4
        )
    view = MirrorView(setup, make_eye_camera(200, 200, 3000.0), pose)
    seen = view.render(eye_view.to_display(drawn))[:, :, 0]
    ink = expected(view, corners).astype(np.float64)
    alike = [np.corrcoef(seen.ravel(), turned.ravel())[0, 1] for turned in (
        ink, ink[:, ::-1], ink[::-1], ink[::-1, ::-1]
    )]  # fmt: skip
    assert alike[0] > 0.85
    assert max(alike[1:]) < 0.7


@pytest.mark.parametrize("seed", few_of(range(12), 3))
def test_a_point_and_what_is_drawn_on_it_are_seen_in_one_place(seed: int) -> None:
    rng = np.random.default_rng(seed)
    setup = draw_setup(rng)
    model, place = true_display(setup), rng.normal(0.0, 8.0, 3)
    points = setup.site_mm + rng.uniform(-50.0, 50.0, (30, 3))
    view = MirrorView(setup, make_eye_camera(8, 8, 3000.0), look_at_site(setup, place))
    drawn = model.project(points, setup.eye_mm + place)
    np.testing.assert_allclose(view.screen_px(drawn), view.site_px(points), atol=1e-6)
