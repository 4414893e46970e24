"""The vote on guesses, beside the same in numpy."""

import numpy as np
import pytest

from navapp.tracking.foreground_kernels import CELL_GREY, CELL_PX, vote_on_guesses

pytestmark = pytest.mark.kernel

LEAST = 4


def expected(
    picture: np.ndarray, is_matched: np.ndarray, is_asked: np.ndarray, is_in_front: np.ndarray
) -> np.ndarray:
    """Each guess by all that speak in the 3 x 3 x 3 cells around its own."""
    rows, columns = np.indices(picture.shape) // CELL_PX
    levels = picture.astype(int) // CELL_GREY
    speaks = is_matched & is_asked
    marks = is_in_front.copy()
    for y, x in np.argwhere(is_asked & ~is_matched):
        near = (
            (np.abs(rows - rows[y, x]) <= 1)
            & (np.abs(columns - columns[y, x]) <= 1)
            & (np.abs(levels - levels[y, x]) <= 1)
            & speaks
        )
        n_front = np.count_nonzero(near & is_in_front)
        n_bone = np.count_nonzero(near) - n_front
        if n_front + n_bone >= LEAST and n_front > n_bone:
            marks[y, x] = True
    return marks


@pytest.mark.parametrize("shape", [(40, 56), (37, 51), (1, 9)])
@pytest.mark.parametrize("share", [0.02, 0.3, 0.9])
def test_guesses_are_marked_as_numpy_marks_them(shape: tuple[int, int], share: float) -> None:
    rng = np.random.default_rng(7)
    picture = rng.integers(0, 256, shape).astype(np.uint8)
    is_matched, is_asked = rng.random(shape) < share, rng.random(shape) < 0.8
    is_in_front = rng.random(shape) < 0.5
    marks = is_in_front.copy()
    vote_on_guesses(picture, is_matched, is_asked, marks)
    np.testing.assert_array_equal(marks, expected(picture, is_matched, is_asked, is_in_front))


def test_what_looks_alike_is_marked_and_what_does_not_is_not() -> None:
    """A guessed strip between a matched hand, light, and matched bone, dark."""
    shape = (32, 60)
    columns = np.broadcast_to(np.arange(60), shape)
    picture = np.where(columns >= 26, 200, 80).astype(np.uint8)
    is_matched = (columns < 20) | (columns >= 34)
    marks = columns >= 34
    vote_on_guesses(picture, is_matched, np.ones(shape, dtype=bool), marks)
    np.testing.assert_array_equal(marks, columns >= 26)


def test_few_that_speak_change_nothing_and_marks_are_never_taken_back() -> None:
    picture = np.full((8, 8), 90, np.uint8)
    is_asked = np.ones((8, 8), dtype=bool)
    for n_front, n_bone, is_marked in ((3, 0, False), (4, 0, True), (4, 4, False)):
        is_matched = np.zeros((8, 8), dtype=bool)
        marks = np.zeros((8, 8), dtype=bool)
        is_matched.flat[: n_front + n_bone] = True
        marks.flat[:n_front] = True
        marks[7, 7] = True
        vote_on_guesses(picture, is_matched, is_asked, marks)
        assert marks[7, 7]
        assert marks[6, 6] == is_marked
