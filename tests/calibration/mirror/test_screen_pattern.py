"""The pattern on a display: where its corners are, and which way round it is seen."""

import numpy as np
import pytest

from calibration.mirror.screen_pattern import find_pattern, make_pattern
from tests.calibration.mirror.simulated_views import BOARD
from tests.many import few_of


@pytest.mark.parametrize("size", few_of([(1920, 1080), (800, 600)]))
@pytest.mark.parametrize("is_mirrored", few_of([True, False]))
def test_corners_are_found_where_they_are_drawn(size: tuple[int, int], is_mirrored: bool) -> None:
    pattern = make_pattern(*size)
    picture = pattern.draw()
    assert picture.shape == size[::-1]
    found = find_pattern(np.ascontiguousarray(picture[:, :: -1 if is_mirrored else 1]), pattern)
    assert found is not None
    seen, told = found
    assert told == is_mirrored
    expected = pattern.pixels[seen.ids]
    if is_mirrored:
        expected = expected * (-1.0, 1.0) + (size[0] - 1.0, 0.0)
    assert len(seen.ids) == len(pattern.pixels)
    np.testing.assert_allclose(seen.pixels, expected, atol=0.02)


def test_its_markers_are_not_those_of_the_board_beside_it() -> None:
    first = make_pattern(800, 600)
    assert make_pattern(800, 600, first.board).board.dictionary != first.board.dictionary
    assert make_pattern(800, 600, BOARD).board.dictionary != BOARD.dictionary
    assert find_pattern(np.full((600, 800), 255, np.uint8), first) is None
