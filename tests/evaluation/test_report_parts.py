"""Lengths, shares, tables, pictures and frames in reports."""

import csv

import pytest

from navapp.evaluation.report_parts import (
    format_mm,
    format_number,
    format_share,
    format_table,
    make_frames_csv,
    make_picture,
    render_markdown,
)
from tests.evaluation.scored import score


def test_lengths_are_short_where_the_bone_is_lost() -> None:
    assert [format_mm(value) for value in (None, 0.0, 0.0456, 9.9994, 10.0, 123.4)] == [
        "-", "0.000", "0.046", "9.999", "10", "123",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("share", "told"),
    [(0.0, "0 %"), (0.0025, "< 1 %"), (0.5, "50 %"), (0.9975, "> 99 %"), (1.0, "100 %"),
     (None, "-")],
)  # fmt: skip
def test_only_all_is_a_hundred_percent_and_only_nothing_none(share, told) -> None:
    assert format_share(share) == told


def test_numbers_have_the_digits_that_are_asked_for() -> None:
    assert [format_number(1.25, n) for n in (0, 1, 2)] == ["1", "1.2", "1.25"]
    assert format_number(None, 2) == "-"


def test_a_table_is_markdown() -> None:
    lines = format_table(("a", "b"), [("1", "2"), ("3", "4")])
    assert lines == ["| a | b |", "|---|---|", "| 1 | 2 |", "| 3 | 4 |"]
    assert "<td>4</td>" in render_markdown("\n".join(lines))
    assert render_markdown("a *b*") == "<p>a <em>b</em></p>\n"


def test_a_picture_stands_in_the_page_with_its_caption() -> None:
    page = make_picture(b"jpeg", "worse & worst")
    assert "data:image/jpeg;base64,anBlZw==" in page
    assert page.count("worse &amp; worst") == 2


def test_every_frame_has_a_line_and_every_line_the_same_columns() -> None:
    frames = [(("a", 1), score(0.1)), (("b", 2), score(None, "LOST", reasons=("x", "y")))]
    first, second = csv.DictReader(make_frames_csv(("name", "number"), frames).splitlines())
    assert (first["name"], first["number"], first["tre_mm"], first["status"]) == (
        "a", "1", "0.1", "OK",
    )  # fmt: skip
    assert (second["tre_mm"], second["reasons"], second["claimed_50_mm"]) == ("", "x; y", "")
    assert None not in first
