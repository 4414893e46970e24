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


@pytest.mark.parametrize(
    "other", [Box(4, 1, 6, 9), Box(-3, 2, 5, 2), Box(0, 0, 8, 6), Box(9, 9, 2, 2)]
)
def test_arrays_over_two_boxes_meet_where_both_are(other: Box) -> None:
    box = Box(1, 0, 7, 5)
    places = [np.mgrid[b.y : b.y + b.height, b.x : b.x + b.width] for b in (box, other)]
    here, there = box.shared_slices(other)
    mine, theirs = places[0][:, *here], places[1][:, *there]
    np.testing.assert_array_equal(mine, theirs)
    rows, columns = places[0]
    in_other = (rows >= other.y) & (rows < other.y + other.height)
    in_other &= (columns >= other.x) & (columns < other.x + other.width)
    assert mine[0].size == in_other.sum()


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
