import numpy as np
import pytest

from navapp.tracking.box.picture_box import PictureBox

A = PictureBox(10.0, 20.0, 40.0, 30.0)


def test_a_box_around_points() -> None:
    box = PictureBox.around(np.array([[10.0, 50.0], [50.0, 20.0], [30.0, 30.0]]))
    assert box == A
    assert PictureBox.around(np.array([[10.0, 50.0], [np.nan, 20.0]])) is None
    assert PictureBox.around(np.array([[10.0, 50.0], [10.0, 20.0]])) is None


def test_moving_scales_about_the_middle() -> None:
    moved = A.move(np.array([5.0, -2.0]), 2.0)
    np.testing.assert_allclose(moved.centre, A.centre + np.array([5.0, -2.0]))
    assert (moved.width, moved.height) == (80.0, 60.0)


def test_resizing_there_and_back() -> None:
    small = A.resize(0.25)
    assert small.width == 10.0
    # The first pixel's centre stays half a pixel inside the picture.
    assert small.x == pytest.approx(0.25 * 10.5 - 0.5)
    assert small.resize(4.0).x == pytest.approx(A.x)
