"""Pictures that are reduced before they are rectified: where they look, and how far."""

import cv2
import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.rectification import Rectifier
from navapp.geometry.reduced_rectification import ReducedRectifier
from navapp.geometry.resampling import TAPS_PX
from tests.geometry.shapes import toed_in_rig


@pytest.fixture(scope="module")
def rectifier():
    return Rectifier(toed_in_rig())


@pytest.mark.parametrize("reduction", [2, 4])
@pytest.mark.parametrize("n_channels", [1, 3])
def test_reduced_pictures_are_the_rectified_ones_reduced(rectifier, reduction, n_channels):
    rng = np.random.default_rng(11)
    shape = (480, 640, n_channels)[: 2 + (n_channels > 1)]
    left, right = (
        cv2.normalize(
            cv2.GaussianBlur(rng.random(shape), (0, 0), 8.0), None, 0, 255, cv2.NORM_MINMAX
        ).astype(np.uint8)
        for _ in range(2)
    )
    size = (640 // reduction, 480 // reduction)
    everything = Box(0, 0, *size)
    small = ReducedRectifier(rectifier, reduction).rectify(left, right, everything, (0.0, 0.0))
    whole = rectifier.rectify(left, right, is_grey=True)
    assert small.box == everything
    inner = (slice(4, -4), slice(4, -4))
    for found, expected in ((small.left, whole.left), (small.right, whole.right)):
        half_a_pixel = reduction // 2
        moved = [np.roll(expected, half_a_pixel, axis) for axis in (0, 1)]
        off, off_down, off_right = (
            np.abs(
                cv2.resize(picture, size, interpolation=cv2.INTER_AREA)[inner]
                - found[inner].astype(float)
            ).mean()
            for picture in (expected, *moved)
        )
        # By less than an eighth of a pixel.
        assert off < 0.25 * min(off_down, off_right)


def test_reduced_pictures_of_another_size_are_refused(rectifier):
    right, wrong = (np.zeros(shape, dtype=np.uint8) for shape in ((480, 640), (480, 600)))
    with pytest.raises(ValueError, match="600x480"):
        ReducedRectifier(rectifier, 4).rectify(wrong, right, Box(0, 0, 9, 9), (0.0, 9.0))


def test_of_reduced_pictures_only_what_a_box_reaches_is_made(rectifier):
    picture = np.random.default_rng(4).integers(1, 256, (480, 640), dtype=np.uint8)
    whole = ReducedRectifier(rectifier, 4).rectify(
        picture, picture, Box(0, 0, 160, 120), (0.0, 0.0)
    )
    part = ReducedRectifier(rectifier, 4).rectify(
        picture, picture, Box(100, 20, 30, 70), (10.0, 60.0)
    )
    assert part.box == Box(100, 20, 30, 70)
    rows = slice(20 - TAPS_PX, 90 + TAPS_PX)
    seen = rows, slice(100 - TAPS_PX, 130 + TAPS_PX)
    np.testing.assert_array_equal(part.left[seen], whole.left[seen])
    reached = rows, slice(100 - 60 - TAPS_PX, 130 - 10 + TAPS_PX)
    np.testing.assert_array_equal(part.right[reached], whole.right[reached])
    assert (part.left[:, : 100 - TAPS_PX] == 0).all()
    assert (part.right[: 20 - TAPS_PX] == 0).all()


def test_of_reduced_pictures_a_box_out_of_view_shows_nothing(rectifier):
    picture = np.full((480, 640), 200, dtype=np.uint8)
    pair = ReducedRectifier(rectifier, 4).rectify(
        picture, picture, Box(200, 20, 30, 70), (10.0, 60.0)
    )
    assert pair.box.is_empty
