"""Sixels, read by a decoder that follows DEC's description character by character."""

import re

import numpy as np
import pytest

from navapp.ui.pictures.sixel import SixelEncoder
from navapp.ui.pictures.sixel_kernels import N_COLOURS, find_colours

pytestmark = pytest.mark.kernel


def decode(text: str) -> np.ndarray:
    """(h, w, 3) BGR of what a terminal draws; pixels that nothing draws are -1."""
    head = re.match(r'\x1bP0;1q"1;1;(\d+);(\d+)', text)
    assert head is not None
    assert text.endswith("\x1b\\")
    width, height = int(head[1]), int(head[2])
    drawn = np.full((height + 6, width, 3), -1)
    colours: dict[int, list[int]] = {}
    colour, x, top = -1, 0, 0
    body = text[head.end() : -2]
    pattern = r"#(\d+);2;(\d+);(\d+);(\d+)|#(\d+)|!(\d+)([?-~])|([?-~])|(\$)|(-)"
    position = 0
    for found in re.finditer(pattern, body):
        assert found.start() == position, body[position : found.start()]
        position = found.end()
        if found[1]:
            colours[int(found[1])] = [round(int(found[k]) * 2.55) for k in (4, 3, 2)]
        elif found[5]:
            colour = int(found[5])
        elif found[6] or found[8]:
            n = int(found[6] or 1)
            bits = ord(found[7] or found[8]) - ord("?")
            for row in range(6):
                if bits >> row & 1:
                    drawn[top + row, x : x + n] = colours[colour]
            x += n
        elif found[9]:
            x = 0
        else:
            x, top = 0, top + 6
    assert position == len(body)
    return drawn[:height]


def nearest(picture: np.ndarray) -> np.ndarray:
    """The colours that the kernel chose, from their numbers."""
    indexes = np.empty(picture.shape[:2], np.uint8)
    find_colours(picture, indexes)
    levels = np.stack([indexes % 6, indexes // 6 % 6, indexes // 36], axis=-1)
    return levels * 51


@pytest.mark.parametrize("shape", [(1, 1), (6, 40), (7, 3), (31, 130)])
@pytest.mark.parametrize("kind", ["noise", "flat", "slope"])
def test_what_is_drawn_are_the_chosen_colours(shape: tuple[int, int], kind: str) -> None:
    rng = np.random.default_rng(5)
    picture = rng.integers(0, 256, (*shape, 3), dtype=np.uint8)
    if kind == "flat":
        picture[:] = (10, 120, 250)
    elif kind == "slope":
        picture[:] = np.linspace(0, 255, shape[1], dtype=np.uint8)[None, :, None]
    encoder = SixelEncoder()
    for _ in range(2):  # its room is used again
        drawn = decode(encoder.encode(1, picture, 1, 1))
        np.testing.assert_allclose(drawn, nearest(picture), atol=1)


def test_dithering_keeps_the_mean_of_every_grey() -> None:
    for grey in range(0, 256, 15):
        drawn = nearest(np.full((16, 16, 3), grey, np.uint8))
        assert drawn.mean() == pytest.approx(grey, abs=4.0)


def test_an_encoder_takes_pictures_of_several_sizes() -> None:
    encoder = SixelEncoder()
    for shape in ((12, 30, 3), (40, 90, 3), (12, 30, 3)):
        picture = np.random.default_rng(6).integers(0, 256, shape, dtype=np.uint8)
        np.testing.assert_allclose(
            decode(encoder.encode(1, picture, 1, 1)), nearest(picture), atol=1
        )
    assert encoder.encode(1, picture, 1, 1).count(";2;") == N_COLOURS
