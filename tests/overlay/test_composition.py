import numpy as np
import pytest

from navapp.overlay import compose_video, make_preview
from navapp.overlay.layers import CANDIDATE_COLOUR, GUIDE_COLOUR
from tests.overlay.scenes import HEIGHT, scene, video

# Rows of the banner at the top and of the mark at the bottom.
TOP, BOTTOM = 40, HEIGHT - 30


def is_colour(image: np.ndarray, colour) -> np.ndarray:
    return (image == np.array(colour, dtype=np.uint8)).all(axis=2)


@pytest.mark.parametrize("is_grey", [False, True])
def test_the_input_is_not_changed(is_grey: bool) -> None:
    left = video()[:, :, 0].copy() if is_grey else video()
    before = left.copy()
    out = compose_video(left, scene("bone", "curves", "targets"), "banner")
    np.testing.assert_array_equal(left, before)
    assert out.shape == (*left.shape[:2], 3)
    assert out.dtype == np.uint8


def test_without_a_scene_only_banner_and_mark_are_drawn() -> None:
    left = video()
    out = compose_video(left, None, "NO GUIDES", "SIMULATED")
    np.testing.assert_array_equal(out[TOP:BOTTOM], left[TOP:BOTTOM])
    assert (out[:TOP] != left[:TOP]).any()
    assert (out[BOTTOM:] != left[BOTTOM:]).any()
    assert not is_colour(out, GUIDE_COLOUR).any()


def test_a_grey_picture_without_a_scene_stays_grey() -> None:
    left = video()[:, :, 0].copy()
    out = compose_video(left, None, "NO GUIDES")
    for channel in range(3):
        np.testing.assert_array_equal(out[TOP:BOTTOM, :, channel], left[TOP:BOTTOM])


def test_guides_are_green_and_a_candidate_is_amber() -> None:
    guides = compose_video(video(), scene("bone"), "x")
    candidate = compose_video(video(), scene("bone", is_candidate=True), "x")
    assert is_colour(guides, GUIDE_COLOUR).sum() > 300
    assert not is_colour(guides, CANDIDATE_COLOUR).any()
    assert is_colour(candidate, CANDIDATE_COLOUR).sum() > 300
    assert not is_colour(candidate, GUIDE_COLOUR).any()


def test_layers_that_nobody_knows_are_left_out() -> None:
    with_unknown = compose_video(video(), scene("hologram", "bone"), "x")
    np.testing.assert_array_equal(with_unknown, compose_video(video(), scene("bone"), "x"))


def test_a_stage_without_layers_draws_nothing() -> None:
    left = video()
    out = compose_video(left, scene(), "x")
    np.testing.assert_array_equal(out[TOP:BOTTOM], left[TOP:BOTTOM])


def test_every_picture_says_that_it_is_research() -> None:
    """The corner is written on whatever the mark is."""
    left = np.zeros((HEIGHT, 640, 3), dtype=np.uint8)
    plain = compose_video(left, None, "")
    assert plain[BOTTOM:].max() > 200
    longer = compose_video(left, None, "", "SIMULATED")
    assert (
        np.flatnonzero(longer[BOTTOM:].any(axis=(0, 2))).max()
        > np.flatnonzero(plain[BOTTOM:].any(axis=(0, 2))).max()
    )


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ((720, 1280), (90, 160)),
        ((480, 640), (96, 128)),
        ((2000, 100), (96, 5)),
        ((3, 4000), (1, 160)),
        ((40, 50), (40, 50)),
    ],
)
def test_a_preview_fits_and_keeps_its_shape(shape, expected) -> None:
    preview = make_preview(np.zeros((*shape, 3), dtype=np.uint8))
    assert preview.shape == (*expected, 3)
    assert not preview.flags.writeable


def test_a_preview_is_the_mean_of_what_it_covers() -> None:
    image = np.zeros((192, 320, 3), dtype=np.uint8)
    image[:, ::2] = 100
    assert (make_preview(image) == 50).all()
