import numpy as np

from navapp.ui.pictures.halfblocks import compute_cell_codes, make_row_strip
from navapp.ui.symbols import ASCII


def test_cells_hold_upper_and_lower_colour_in_red_green_blue_order() -> None:
    picture = np.zeros((2, 1, 3), dtype=np.uint8)
    picture[0, 0] = (0, 0, 255)  # BGR: red above
    picture[1, 0] = (255, 0, 0)  # blue below
    assert compute_cell_codes(picture, 1, 1).tolist() == [[0xF0000F]]


def test_what_is_beside_the_picture_is_black() -> None:
    codes = compute_cell_codes(np.full((10, 10, 3), 255, dtype=np.uint8), 20, 5)
    assert (codes[:, :5] == 0).all()
    assert (codes[:, 5:15] == 0xFFFFFF).all()
    assert (codes[:, 15:] == 0).all()


def test_equal_cells_become_one_segment() -> None:
    strip = make_row_strip(np.array([7, 7, 7, 0xFFF000, 0xFFF000], dtype=np.int32))
    assert [segment.text for segment in strip] == ["▀▀▀", "▀▀"]
    assert strip.cell_length == 5


def test_cells_of_one_colour_need_no_character() -> None:
    strip = make_row_strip(np.array([0x123123], dtype=np.int32))
    (segment,) = strip
    assert segment.text == " "
    assert segment.style is not None
    assert segment.style.bgcolor is not None
    assert segment.style.bgcolor.name == "#112233"


def test_without_half_blocks_brightness_is_ink() -> None:
    strip = make_row_strip(np.array([0, 0x888888, 0xFFFFFF], dtype=np.int32), ASCII.ramp)
    text = "".join(segment.text for segment in strip)
    assert text.isascii()
    assert text[0] == " "
    assert text[2] == "@"
