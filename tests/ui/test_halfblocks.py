import numpy as np
import pytest

from navapp.ui.halfblocks import (
    compute_cell_codes,
    find_place,
    fit_size,
    make_row_strip,
    resize_by_area,
)
from navapp.ui.symbols import ASCII


def test_resizing_keeps_the_mean() -> None:
    picture = np.random.default_rng(3).integers(0, 256, (90, 160, 3), dtype=np.uint8)
    resized = resize_by_area(picture, 31, 53)
    assert resized.shape == (31, 53, 3)
    np.testing.assert_allclose(resized.mean((0, 1)), picture.mean((0, 1)), atol=1e-9)


def test_resizing_by_a_whole_factor_is_the_mean_of_blocks() -> None:
    picture = np.random.default_rng(4).integers(0, 256, (6, 8, 3), dtype=np.uint8)
    expected = picture.reshape(3, 2, 4, 2, 3).mean((1, 3))
    np.testing.assert_allclose(resize_by_area(picture, 3, 4), expected, atol=1e-9)


def test_enlarging_by_a_whole_factor_repeats_pixels() -> None:
    picture = np.random.default_rng(5).integers(0, 256, (2, 3, 3), dtype=np.uint8)
    expected = picture.repeat(2, axis=0).repeat(2, axis=1)
    np.testing.assert_allclose(resize_by_area(picture, 4, 6), expected, atol=1e-9)


@pytest.mark.parametrize(("columns", "rows"), [(52, 15), (114, 30), (3, 40), (1, 1)])
def test_the_picture_fits_its_box_and_keeps_its_aspect(columns: int, rows: int) -> None:
    width, height = fit_size((90, 160), columns, rows)
    assert 1 <= width <= columns
    assert 2 <= height <= 2 * rows
    if columns > 10:
        assert width / height == pytest.approx(160 / 90, rel=0.05)


@pytest.mark.parametrize(("columns", "rows"), [(52, 15), (114, 30), (160, 20)])
def test_a_cell_tells_which_place_of_the_picture_it_shows(columns: int, rows: int) -> None:
    picture = np.zeros((90, 160, 3), dtype=np.uint8)
    picture[30:36, 100:106] = 255
    lit = np.argwhere(compute_cell_codes(picture, columns, rows) > 0)
    places = [find_place((90, 160), columns, rows, x, y) for y, x in lit.tolist()]
    assert np.mean(places, axis=0) == pytest.approx([103 / 160, 33 / 90], abs=0.02)
    assert find_place((90, 160), columns, rows, 0, -5) == (pytest.approx(0.0, abs=0.01), 0.0)


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
