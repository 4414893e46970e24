"""What terminals answer, as kitty 0.26, xterm 379 and tmux 3.3 do, and what is made of it."""

import pytest

from navapp.ui.pictures.graphics import (
    Answers,
    choose_graphics,
    find_graphics,
    parse_answers,
)

KITTY = b"\x1b_Gi=32;OK\x1b\\\x1b_Gi=31;OK\x1b\\\x1b[6;18;9t\x1b[?62;c"
REMOTE_KITTY = KITTY.replace(b"i=31;OK", b"i=31;EBADF:no such file")
XTERM = b"\x1b[6;13;6t\x1b[?64;1;2;4;6;9;15;18;21;22c\x1b[?1;0;256S\x1b[?64;1;2;4c"
VT340 = b"\x1b[6;13;6t\x1b[?63;1;2;4c\x1b[?1;0;16S\x1b[?63;1;2;4c"
TMUX = b"\x1b[?1;2c"


@pytest.mark.parametrize(
    ("told", "wish", "words"),
    [
        (KITTY, "auto", "kitty, shared memory"),
        (REMOTE_KITTY, "auto", "kitty, compressed"),
        (XTERM, "auto", "sixel"),
        (KITTY + XTERM, "sixel", "sixel"),
        (KITTY + XTERM, "kitty", "kitty, shared memory"),
        (XTERM, "kitty", "half blocks: this terminal draws no pictures"),
        (TMUX, "auto", "half blocks: this terminal draws no pictures"),
        (b"", "auto", "half blocks: this terminal draws no pictures"),
        (VT340, "auto", "half blocks: the terminal has 16 colours for sixel, 216 are needed"),
    ],
)
def test_the_best_is_chosen_that_was_answered_for(told: bytes, wish, words: str) -> None:
    graphics = choose_graphics(wish, parse_answers(told), {"TERM": "xterm-256color"})
    assert graphics.words == words
    assert graphics.has_pixels != words.startswith("half blocks")
    assert graphics.cell_px in (((9, 18), (6, 13)) if graphics.has_pixels else ((1, 2),))


def test_a_terminal_of_level_4_does_not_draw_sixels_by_that() -> None:
    assert not parse_answers(b"\x1b[?4;6c").has_sixel


def test_without_the_size_of_a_cell_nothing_can_be_placed() -> None:
    graphics = choose_graphics("auto", Answers(has_kitty=True, has_sixel=True), {"TMUX": "x"})
    assert graphics.encoder is None
    assert "tmux passes no pictures on" in graphics.words


@pytest.mark.parametrize(("wish", "term"), [("blocks", "xterm-kitty"), ("auto", "linux")])
def test_some_terminals_are_not_asked(wish, term: str) -> None:
    # Under pytest there is no terminal that could be asked.
    assert find_graphics(wish, {"TERM": term}).encoder is None


@pytest.mark.parametrize(
    ("environment", "is_written_past_textual"),
    [
        ({"TERM": "screen-256color"}, True),
        ({"TERM": "xterm", "COLORTERM": "truecolor"}, True),
        ({"TERM": "xterm"}, False),
        ({"TERM": "xterm-256color", "NO_COLOR": "1"}, False),
    ],
)
def test_half_blocks_are_written_directly_where_there_are_colours(
    environment: dict[str, str], is_written_past_textual: bool
) -> None:
    graphics = find_graphics("blocks", environment)
    assert (graphics.encoder is not None) == is_written_past_textual
    assert not graphics.has_pixels
