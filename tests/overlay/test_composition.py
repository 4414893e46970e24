"""The whole picture: video, layers, words."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from navapp.geometry.rig import StereoRig
from navapp.overlay import LAYERS, LeftView, compose_video, labels, put_mark
from navapp.overlay.colours import CANDIDATE, GUIDE
from navapp.overlay.composition import text_boxes
from navapp.overlay.labels import LabelBoard
from navapp.overlay.painting import paint_layers
from tests.overlay.layers.test_layers import full
from tests.overlay.scenes import (
    CAMERA,
    HEIGHT,
    RIG,
    WIDTH,
    black,
    is_colour,
    scene,
    seen,
    video,
)

TOP, BOTTOM = (box.height for box in text_boxes(WIDTH, HEIGHT))
CLEAR = slice(TOP, HEIGHT - BOTTOM)


@pytest.mark.parametrize("is_grey", [False, True])
def test_the_input_is_not_changed(is_grey: bool) -> None:
    left = video()[:, :, 0].copy() if is_grey else video()
    before = left.copy()
    out = compose_video(left, seen(full()), "banner")
    np.testing.assert_array_equal(left, before)
    assert out.shape == (*left.shape[:2], 3)
    assert out.dtype == np.uint8


def test_without_a_scene_only_banner_and_mark_are_drawn() -> None:
    left = video()
    out = compose_video(left, None, "NO GUIDES", "SIMULATED")
    np.testing.assert_array_equal(out[CLEAR], left[CLEAR])
    assert (out[:TOP] != left[:TOP]).any()
    assert (out[-BOTTOM:] != left[-BOTTOM:]).any()
    assert not is_colour(out, GUIDE).any()


def test_a_grey_picture_without_a_scene_stays_grey() -> None:
    left = video()[:, :, 0].copy()
    out = compose_video(left, None, "NO GUIDES")
    for channel in range(3):
        np.testing.assert_array_equal(out[CLEAR, :, channel], left[CLEAR])


def test_guides_are_green_and_a_candidate_is_amber() -> None:
    guides = compose_video(video(), seen(scene("bone")), "x")
    candidate = compose_video(video(), seen(scene("bone", is_candidate=True)), "x")
    assert is_colour(guides, GUIDE).sum() > 300
    assert not is_colour(guides, CANDIDATE).any()
    assert is_colour(candidate, CANDIDATE).sum() > 300
    assert not is_colour(candidate, GUIDE).any()


def test_layers_that_nobody_knows_are_left_out() -> None:
    with_unknown = compose_video(video(), scene("hologram", "bone"), "x")
    np.testing.assert_array_equal(with_unknown, compose_video(video(), scene("bone"), "x"))


def test_a_scene_without_layers_draws_nothing() -> None:
    left = video()
    out = compose_video(left, scene(), "x")
    np.testing.assert_array_equal(out[CLEAR], left[CLEAR])


def test_a_picture_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="not the camera's"):
        compose_video(video()[:-1], scene("bone"), "x")


@pytest.mark.parametrize("order", [1, -1])
def test_layers_are_drawn_in_the_order_of_their_table(order: int) -> None:
    names = list(LAYERS)[::order]
    one = compose_video(video(), replace(seen(full()), layers=tuple(names)), "x")
    np.testing.assert_array_equal(one, compose_video(video(), seen(full()), "x"))


@pytest.mark.parametrize("scale", [1.0, 2.0, 3.0, 4.0])
def test_labels_lie_neither_over_each_other_nor_over_banner_and_mark(scale: float) -> None:
    camera = CAMERA.scale(scale)
    rig = StereoRig(camera, camera, RIG.right_from_left, RIG.serials)
    given = replace(full(), viewpoint=LeftView(rig))
    height, width = camera.height, camera.width
    image = np.zeros((height, width, 3), np.uint8)
    rims = text_boxes(width, height)
    board = LabelBoard(0.45, list(rims))
    paint_layers(lambda: image, given, board)
    assert len(board.taken) >= len(rims) + 5
    assert not any(not one.intersect(other).is_empty for one, other in combinations(board.taken, 2))


@pytest.mark.parametrize(("width", "height"), [(640, 480), (1280, 720), (1920, 1080), (3840, 2160)])
def test_banner_and_mark_lie_in_their_rows(width: int, height: int) -> None:
    left = np.full((height, width), 128, np.uint8)
    out = compose_video(left, None, "4 patella (gy) - NO GUIDES", "SIMULATED (gy)")
    top, bottom = (box.height for box in text_boxes(width, height))
    rows = np.flatnonzero((out != 128).any(axis=(1, 2)))
    upper, lower = rows[rows < height // 2], rows[rows > height // 2]
    assert upper.max() < top <= upper.max() + 12
    assert height - bottom <= lower.min() <= height - bottom + 14
    assert len(lower) > 6


def test_every_picture_says_that_it_is_research(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(
        "navapp.overlay.composition.put_text", lambda _, text, *rest: said.append(text)
    )
    compose_video(black(), None, "a")
    compose_video(black(), None, "b", "SIMULATED")
    mark = "research - not for clinical use"
    assert said == ["a", mark, "b", f"SIMULATED - {mark}"]


def test_a_mark_is_put_into_the_upper_right_corner_of_a_copy() -> None:
    before = video()
    marked = put_mark(before, "not for clinical use")
    np.testing.assert_array_equal(before, video())
    rows, columns = np.nonzero((marked != before).any(axis=2))
    assert rows.max() < 40
    assert columns.min() > WIDTH // 2
    assert columns.max() > WIDTH - 20
    width, _ = labels.text_size("not for clinical use", 0.45)
    assert columns.max() - columns.min() > 0.9 * width
