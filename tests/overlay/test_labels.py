"""Words that never lie over each other."""

from itertools import combinations

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.overlay.labels import LabelBoard, put_text, text_size

WHITE = (255, 255, 255)


def grey(height: int = 300, width: int = 500) -> np.ndarray:
    return np.full((height, width, 3), 128, dtype=np.uint8)


def touches(one: Box, other: Box) -> bool:
    return not one.intersect(other).is_empty


@pytest.mark.parametrize("seed", range(4))
def test_labels_lie_neither_over_each_other_nor_over_what_is_taken(seed: int) -> None:
    rng = np.random.default_rng(seed)
    taken = [Box(0, 0, 500, 40), Box(200, 150, 60, 60)]
    board = LabelBoard(0.45, list(taken))
    for number in range(14):
        board.add(f"label {number}" + "g" * int(rng.integers(0, 9)), rng.uniform(0, 300, 2), WHITE)
    placed = board.draw(grey())
    assert len(placed) > 6
    assert all(box.clip(500, 300) == box for box in placed)
    assert not any(touches(*pair) for pair in combinations([*placed, *taken], 2))
    assert board.taken == [*taken, *placed]


@pytest.mark.parametrize("size", [0.45, 0.7, 1.05])
def test_a_label_is_written_inside_its_box(size: int) -> None:
    image, board = grey(), LabelBoard(size)
    board.add("popliteal artery (5 mm)", np.array([30.0, 140.0]), WHITE)
    (box,) = board.draw(image)
    rows, columns = np.nonzero((image != 128).any(axis=2))
    assert box.x <= columns.min()
    assert columns.max() < box.x + box.width
    assert box.y <= rows.min()
    assert rows.max() < box.y + box.height
    assert rows.max() - rows.min() > 0.6 * box.height


def test_a_label_stands_beside_its_point() -> None:
    board = LabelBoard(0.45)
    board.add("guide", np.array([100.0, 100.0]), WHITE)
    (box,) = board.draw(grey())
    assert not touches(box, Box(100, 100, 1, 1))
    assert touches(box.grow(16), Box(100, 100, 1, 1))


def test_one_that_had_to_go_further_has_a_line_to_its_point() -> None:
    image = grey()
    board = LabelBoard(0.45, [Box(60, 60, 180, 80)])
    board.add("guide", np.array([150.0, 100.0]), WHITE)
    (box,) = board.draw(image)
    assert not touches(box.grow(20), Box(150, 100, 1, 1))
    assert (image[100, 150] > 200).all()


def test_what_has_no_place_is_left_out() -> None:
    image, board = grey(), LabelBoard(0.45, [Box(0, 0, 500, 300)])
    board.add("guide", np.array([150.0, 100.0]), WHITE)
    assert board.draw(image) == []
    assert (image == 128).all()


@pytest.mark.parametrize("at", [(np.nan, 5.0), (-3.0, 50.0), (50.0, 300.0), (1e9, 1e9)])
def test_a_point_beside_the_picture_has_no_label(at) -> None:
    image, board = grey(), LabelBoard(0.45)
    board.add("guide", np.array(at), WHITE)
    assert board.draw(image) == []
    assert (image == 128).all()


def test_labels_are_drawn_once() -> None:
    board = LabelBoard(0.45)
    board.add("guide", np.array([150.0, 100.0]), WHITE)
    assert len(board.draw(grey())) == 1
    assert board.draw(grey()) == []


def test_text_can_be_read_on_white_and_on_black() -> None:
    width, height = text_size("guide", 0.7)
    for ground in (0, 255):
        image = np.full((60, 120, 3), ground, dtype=np.uint8)
        put_text(image, "guide", (10, 40), 0.7, WHITE)
        part = image[40 - height : 48, 8 : 12 + width]
        assert part.min() < 30
        assert part.max() > 225
