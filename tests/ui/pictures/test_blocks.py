"""Half blocks, read by a small terminal of our own."""

import re

import numpy as np
import pytest

from navapp.ui.pictures.blocks import BlockEncoder

pytestmark = pytest.mark.kernel


def colour_of(index: int) -> tuple[int, int, int]:
    """RGB of one of the 256 colours, as xterm has them."""
    if index >= 232:
        return (8 + 10 * (index - 232),) * 3
    levels = (0, 95, 135, 175, 215, 255)
    return levels[(index - 16) // 36], levels[(index - 16) // 6 % 6], levels[(index - 16) % 6]


def draw(text: str, rows: int, columns: int) -> np.ndarray:
    """(2 rows, columns, 3) BGR that a terminal shows; the cursor never leaves it."""
    drawn = np.full((2 * rows, columns, 3), -1)
    x, y, colours = 0, 0, {38: (0, 0, 0), 48: (0, 0, 0)}
    position = 0
    for found in re.finditer(r"\x1b\[([\d;]*)([mBD])|([ ▀])", text):
        assert found.start() == position
        position = found.end()
        if found[2] == "B":
            y += 1
        elif found[2] == "D":
            x -= int(found[1])
        elif found[2] == "m" and found[1]:
            kind, way, *rest = map(int, found[1].split(";"))
            assert (way, len(rest)) in ((2, 3), (5, 1))
            colours[kind] = tuple(rest) if way == 2 else colour_of(rest[0])
        elif found[3]:
            drawn[2 * y + 1, x] = colours[48][::-1]
            drawn[2 * y, x] = colours[38 if found[3] == "▀" else 48][::-1]
            x += 1
    assert position == len(text)
    assert text.endswith("\x1b[m")
    return drawn


PICTURES = {
    "noise": np.random.default_rng(2).integers(0, 256, (14, 23, 3), dtype=np.uint8),
    "flat": np.full((14, 23, 3), (40, 200, 90), np.uint8),
    "grey": np.repeat(np.linspace(0, 255, 14 * 23).reshape(14, 23, 1), 3, axis=2).astype(np.uint8),
}


@pytest.mark.parametrize("kind", list(PICTURES))
def test_true_colours_are_right_to_half_a_level(kind: str) -> None:
    picture = PICTURES[kind]
    drawn = draw(BlockEncoder(is_true_colour=True).encode(1, picture, 23, 7), 7, 23)
    np.testing.assert_allclose(drawn, picture, atol=9)


@pytest.mark.parametrize("kind", list(PICTURES))
def test_of_256_colours_the_nearest_is_taken(kind: str) -> None:
    picture = PICTURES[kind].astype(int)
    drawn = draw(BlockEncoder(is_true_colour=False).encode(1, PICTURES[kind], 23, 7), 7, 23)
    palette = np.array([colour_of(k)[::-1] for k in range(16, 256)])
    off = ((picture[:, :, None] - palette) ** 2).sum(axis=-1).min(axis=-1)
    np.testing.assert_array_equal(((picture - drawn) ** 2).sum(axis=-1), off)


def test_equal_cells_name_their_colour_once() -> None:
    text = BlockEncoder(is_true_colour=True).encode(1, PICTURES["flat"], 23, 7)
    assert text.count("48;2;") == 1
    assert "▀" not in text


def test_green_and_amber_outlines_differ_in_256_colours() -> None:
    picture = np.zeros((2, 2, 3), np.uint8)
    picture[:, 0], picture[:, 1] = (90, 230, 60), (30, 170, 250)
    drawn = draw(BlockEncoder(is_true_colour=False).encode(1, picture, 2, 1), 1, 2)
    assert np.abs(drawn[0, 0] - drawn[0, 1]).max() > 100
