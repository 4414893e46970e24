"""The cross on the display, and the small pictures of the cameras."""

import numpy as np
import pytest

from calibration.targets.detection import SeenBoard
from navapp.control.mirror_alignment.corner_previews import preview_board
from navapp.control.mirror_alignment.cross_picture import draw_cross


@pytest.mark.parametrize("pixel", [(60, 40), (61, 43)])
def test_a_cross_lies_about_its_pixel(pixel):
    lit = draw_cross(120, 90, pixel)[:, :, 1] > 0
    rows, columns = np.nonzero(lit)
    assert (columns.min() + columns.max(), rows.min() + rows.max()) == (2 * pixel[0], 2 * pixel[1])
    # One pixel thin around its middle.
    assert lit[pixel[1] - 5, pixel[0] - 5 : pixel[0] + 6].sum() == 1
    assert lit[pixel[1] - 5 : pixel[1] + 6, pixel[0] + 5].sum() == 1


@pytest.mark.parametrize("pixel", [(0, 0), (119, 89)])
def test_a_cross_at_the_rim_is_cut(pixel):
    picture = draw_cross(120, 90, pixel)
    assert picture.shape == (90, 120, 3)
    assert picture[pixel[1], pixel[0], 1] > 0
    assert (picture[:, :, 1] > 0).sum() < 140


def test_the_corner_is_ringed_in_the_picture_of_the_board():
    grey = np.full((720, 1280), 90, np.uint8)
    x, y = np.meshgrid(np.arange(300.0, 900.0, 100.0), np.arange(200.0, 500.0, 100.0))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    seen = SeenBoard(np.arange(len(pixels)), pixels, np.ones(len(pixels)), 1.0)
    plain, ringed = preview_board(grey, seen, None), preview_board(grey, seen, 8)
    changed = np.argwhere((plain != ringed).any(axis=2))
    assert plain.shape == (128, 192, 3)
    # The ring is where the mark is, in the part that is shown: 750 px wide about the middle.
    middle = 0.5 * (changed.min(axis=0) + changed.max(axis=0))
    scale = 192.0 / (1.3 * 500.0)
    np.testing.assert_allclose(
        middle[::-1], (96 + scale * (500 - 550), 64 + scale * (300 - 300)), atol=2.0
    )


def test_without_a_board_the_whole_picture_is_shown():
    bgr = np.zeros((720, 1280, 3), np.uint8)
    bgr[:, 640:] = 200
    small = preview_board(bgr, None, None)
    assert small[64, 20].max() == 0
    assert small[64, 170].min() > 150
