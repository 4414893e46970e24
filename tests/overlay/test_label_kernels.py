"""Compiled placing and blending of words, beside plain forms."""

import numpy as np
import pytest

from navapp.overlay.label_kernels import blend_text, find_free_place

pytestmark = pytest.mark.kernel


def test_the_first_box_that_is_free_is_found() -> None:
    offsets = np.array([[-41.0, 5], [5, 96], [40, 40], [60, 20], [61, 20], [20, 20]]) - (0, 10.4)
    shares = np.array([[0.0, 0], [0, 0], [0.5, -1], [0, 0], [0, 0], [0, 0]])
    others = np.array([[50, 35, 20, 3], [50, 0, 11, 100]])
    given = (0.2, 10.0), offsets, shares, (20, 10), (100, 100)
    # Beside the picture, below it, over one, over the other by a column; then free.
    assert find_free_place(*given, others) == (61, 20, True)
    assert find_free_place(given[0], offsets[:4], shares[:4], *given[3:], others)[2] is False
    nowhere = np.empty((0, 4), np.int64)
    assert find_free_place(*given, nowhere) == (50, 30, True)


@pytest.mark.parametrize("corner", [(4, 3), (-5, -2), (25, 16), (40, 40)])
def test_letters_are_blended_over_their_rim_inside_the_picture(corner: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    before = rng.integers(0, 256, (20, 30, 3), dtype=np.uint8)
    letters = rng.choice([0, 102, 255], (6, 12)).astype(np.uint8)
    rim = np.maximum(letters, rng.choice([0, 180], (6, 12)).astype(np.uint8))
    image = before.copy()
    blend_text(image, letters, rim, corner, (10, 200, 250))
    expected = before.astype(float)
    for y in range(6):
        for x in range(12):
            row, column = y + corner[1], x + corner[0]
            if 0 <= row < 20 and 0 <= column < 30:
                below = expected[row, column] * (1.0 - rim[y, x] / 255.0)
                colour = np.array([10.0, 200.0, 250.0])
                expected[row, column] = below + letters[y, x] / 255.0 * (colour - below)
    assert np.abs(image - expected).max() <= 0.5 + 1e-3
