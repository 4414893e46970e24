import numpy as np
import pytest

from navapp.tracking.box.templates import SIZE_PX, find_anywhere, find_near, find_turned, learn
from tests.picture_boxes import overlap
from tests.tracking.box.pictures import BOX, SHAPE, box_at, clutter, empty, scene, turned


@pytest.fixture(scope="module")
def templates():
    return learn(None, scene(), BOX)


@pytest.mark.parametrize(
    ("shift", "scale", "gain"),
    [
        ((0.0, 0.0), 1.0, 1.0),
        ((-70.0, 20.0), 1.0, 0.6),
        ((60.0, -30.0), 1.12, 1.3),
        ((90.0, 10.0), 0.9, 1.0),
    ],
)
def test_a_thing_is_found_anywhere_in_any_light(templates, shift, scale, gain) -> None:
    found = find_anywhere(templates, scene(shift, scale, gain, seed=7), BOX)
    assert overlap(found.box, box_at(shift, scale)) > 0.8
    assert found.similarity > 0.7


@pytest.mark.parametrize("hidden_fraction", [0.2, 0.3])
def test_the_whole_box_of_a_thing_that_is_hidden_in_part(templates, hidden_fraction) -> None:
    shift = (-40.0, 12.0)
    found = find_anywhere(templates, scene(shift, hidden_fraction=hidden_fraction, seed=7), BOX)
    assert overlap(found.box, box_at(shift)) > 0.7
    assert found.similarity > 0.53


@pytest.mark.parametrize("seed", range(4))
def test_nothing_else_is_like_it(templates, seed: int) -> None:
    for picture in (clutter(4.0, 25.0, 50 + seed), empty(seed)):
        assert find_anywhere(templates, picture, BOX).similarity < 0.55
        assert find_turned(templates, picture, BOX).similarity < 0.55


@pytest.mark.parametrize("turn_deg", [-27.0, -20.0, 20.0, 27.0])
def test_a_thing_that_has_turned_in_the_picture(templates, turn_deg: float) -> None:
    true = box_at((-40.0, 12.0))
    picture = turned(scene((-40.0, 12.0), seed=7), true, turn_deg)
    assert find_anywhere(templates, picture, BOX).similarity < 0.57
    found = find_turned(templates, picture, BOX)
    assert found.similarity > 0.57
    np.testing.assert_allclose(found.box.centre, true.centre, atol=4.0)
    assert (found.box.width, found.box.height) == pytest.approx((BOX.width, BOX.height))


@pytest.mark.parametrize("grey", [0, 90, 255])
def test_a_flat_picture_is_like_nothing(templates, grey: int) -> None:
    assert find_anywhere(templates, np.full(SHAPE, grey, np.uint8), BOX).similarity == 0.0


def test_a_template_without_a_pattern_is_like_nothing() -> None:
    """A flat template correlates with everything."""
    flat = learn(None, np.full(SHAPE, 255, np.uint8), BOX)
    assert find_anywhere(flat, scene(), BOX).similarity == 0.0


def test_a_box_lies_in_view_by_half_at_least(templates) -> None:
    for shift in ((-145.0, 0.0), (160.0, 0.0), (0.0, 90.0)):
        found = find_anywhere(templates, scene(shift, seed=7), BOX)
        np.testing.assert_allclose(found.box.centre, box_at(shift).centre, atol=6.0)


@pytest.mark.parametrize(
    ("off", "scale"), [((3.0, -3.0), 1.0), ((-6.0, 7.0), 1.0), ((2.0, 2.0), 1.04)]
)
def test_a_box_a_little_off_is_put_right(templates, off, scale: float) -> None:
    shift = (3.0, 5.0)
    true = box_at(shift)
    found = find_near(templates, scene(shift, seed=7), true.move(np.array(off), scale))
    np.testing.assert_allclose(found.box.centre, true.centre, atol=2.0)
    assert overlap(found.box, true) > 0.92


def test_a_box_is_looked_for_near_it_alone(templates) -> None:
    far = box_at((40.0, 0.0))
    assert find_near(templates, scene(seed=7), far).similarity < 0.4
    assert find_near(templates, scene((40.0, 0.0), seed=7), far).similarity > 0.9


def test_the_first_template_and_the_newest_are_kept(templates) -> None:
    grown = templates
    for seed in range(8):
        grown = learn(grown, clutter(3.0, 30.0, 100 + seed), BOX)
        assert len(grown) <= 5
    assert grown.shape == (5, 3, SIZE_PX, SIZE_PX)
    np.testing.assert_array_equal(grown[0], templates[0])
    for seed in range(4, 8):
        assert find_near(grown, clutter(3.0, 30.0, 100 + seed), BOX).similarity > 0.99


def test_what_is_known_is_not_kept_twice(templates) -> None:
    assert len(learn(templates, scene((2.0, 1.0), seed=9), box_at((2.0, 1.0)))) == 1
    assert len(learn(templates, clutter(3.0, 30.0, 9), BOX)) == 2
