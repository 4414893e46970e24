import pytest

from navapp.ui.gauges import Number, cut, draw_bar, draw_fraction_bar, draw_sparkline
from navapp.ui.symbols import ASCII, UNICODE


@pytest.mark.parametrize("number", list(Number))
@pytest.mark.parametrize("value", [None, float("nan"), -1.0, 0.0, 0.204, 9.999, 123.4, 1e9])
def test_a_number_keeps_its_width_for_any_value(number: Number, value: float | None) -> None:
    assert len(number.text(value)) == number.value[0]


def test_a_number_that_is_absent_shows_no_digit() -> None:
    assert not any(character.isdigit() for character in Number.MM.text(None))


def test_a_bar_marks_its_limit_and_fills_in_proportion() -> None:
    empty, half, at_limit = (draw_bar(value, 1.0, 22, ASCII) for value in (0.0, 0.5, 1.0))
    assert empty == "[................|...]"
    assert half == "[########........|...]"
    assert at_limit == "[################|...]"


def test_a_bar_says_when_the_value_is_beyond_its_end() -> None:
    assert draw_bar(7.0, 1.0, 22, ASCII) == "[################|##>]"


@pytest.mark.parametrize("value", [None, float("nan")])
def test_a_bar_without_a_value_is_empty(value: float | None) -> None:
    assert ASCII.bar_full not in draw_bar(value, 1.0, 22, ASCII)


def test_progress_beyond_its_end_stays_inside() -> None:
    assert draw_fraction_bar(1.7, 6, ASCII) == "[####]"
    assert draw_fraction_bar(-0.2, 6, ASCII) == "[....]"


def test_a_sparkline_has_the_newest_at_the_right_and_fixed_width() -> None:
    line = draw_sparkline([1.0, 2.0, 4.0], 5, UNICODE)
    assert len(line) == 5
    assert line.startswith("  ")
    assert line[-1] > line[-2] > line[-3]


@pytest.mark.parametrize("values", [[], [0.0, 0.0], [float("nan")]])
def test_a_sparkline_of_nothing_is_blank(values: list[float]) -> None:
    assert draw_sparkline(values, 4, UNICODE) == "    "


def test_cut_makes_one_line_and_marks_what_is_missing() -> None:
    assert cut("two\nlines", 20, UNICODE) == "two lines"
    assert cut("a long text", 6, ASCII) == "a lon~"
    assert cut("anything", 0, ASCII) == ""
