import numpy as np
import pytest

from navapp.geometry.box import Box


def test_a_box_grows_on_every_side():
    assert Box(5, 6, 10, 20).grow(3) == Box(2, 3, 16, 26)
    assert Box(5, 6, 10, 20).grow(-5).is_empty


@pytest.mark.parametrize(
    ("box", "clipped"),
    [
        (Box(-5, -6, 20, 30), Box(0, 0, 15, 24)),
        (Box(630, 470, 20, 30), Box(630, 470, 10, 10)),
        (Box(10, 10, 5, 5), Box(10, 10, 5, 5)),
        (Box(-50, 10, 20, 5), Box(0, 10, 0, 5)),
        (Box(900, 900, 20, 5), Box(640, 480, 0, 0)),
        (Box(5, 5, -3, 4), Box(5, 5, 0, 4)),
    ],
)
def test_a_box_is_clipped_to_the_picture(box, clipped):
    assert box.clip(640, 480) == clipped
    assert clipped.is_empty == (clipped.width == 0 or clipped.height == 0)


def test_overlap_is_the_share_of_the_union():
    assert Box(0, 0, 10, 10).overlap(Box(0, 0, 10, 10)) == 1.0
    assert Box(0, 0, 10, 10).overlap(Box(5, 0, 10, 10)) == pytest.approx(50 / 150)
    assert Box(0, 0, 10, 10).overlap(Box(20, 20, 5, 5)) == 0.0
    assert Box(0, 0, 10, 10).overlap(Box(20, 0, 5, 10)) == 0.0
    assert Box(0, 0, 0, 0).overlap(Box(0, 0, 0, 0)) == 0.0


def test_a_box_around_pixels_holds_them_and_no_more():
    pixels = np.array([[3.2, 4.7], [10.0, -2.1], [np.nan, 5.0], [np.nan, np.nan]])
    assert Box.around(pixels) == Box(3, -3, 8, 9)
    assert Box.around(np.array([[4.0, 5.0]])) == Box(4, 5, 1, 1)
    assert Box.around(np.full((2, 2), np.nan)) is None
    assert Box.around(np.empty((0, 2))) is None


def test_two_boxes_share_the_pixels_of_both() -> None:
    one, other = Box(3, 4, 10, 6), Box(8, -2, 20, 9)
    both = one.intersect(other)
    assert both == Box(8, 4, 5, 3) == other.intersect(one)
    assert both.relative_to(one) == Box(5, 0, 5, 3)
    assert both.relative_to(other) == Box(0, 6, 5, 3)
    assert one.intersect(Box(13, 4, 5, 5)).is_empty
    assert one.intersect(Box(90, 90, 5, 5)).is_empty
