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


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (A, 1.0),
        (PictureBox(30.0, 20.0, 40.0, 30.0), 600.0 / 1800.0),
        (PictureBox(60.0, 20.0, 40.0, 30.0), 0.0),
        (PictureBox(20.0, 25.0, 20.0, 15.0), 0.25),
    ],
)
def test_overlap(other: PictureBox, expected: float) -> None:
    assert A.overlap(other) == pytest.approx(expected)
    assert other.overlap(A) == pytest.approx(expected)


def test_what_lies_in_a_picture() -> None:
    assert A.clip(320, 180) == A
    out = PictureBox(-20.0, 10.0, 40.0, 30.0)
    assert out.clip(320, 180) == PictureBox(0.0, 10.0, 20.0, 30.0)
    assert PictureBox(-60.0, 10.0, 40.0, 30.0).clip(320, 180).width == 0.0
