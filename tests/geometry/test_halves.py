"""Places in a picture at half its resolution."""

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.halves import double, half_box

BOXES = [Box(0, 0, 6, 4), Box(3, 5, 7, 4), Box(2, 1, 1, 1), Box(1, 1, 2, 2)]


@pytest.mark.parametrize("dtype", [np.float32, np.uint8])
@pytest.mark.parametrize("box", BOXES)
def test_each_pixel_has_what_its_half_pixel_has(box: Box, dtype: type) -> None:
    half = half_box(box)
    values = np.arange(half.width * half.height, dtype=dtype).reshape(half.height, half.width)
    rows, columns = np.mgrid[: box.height, : box.width]
    expected = values[(rows + box.y) // 2 - half.y, (columns + box.x) // 2 - half.x]
    found = double(values, box)
    assert found.dtype == dtype
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("box", [Box(0, 0, 0, 10), Box(3, 3, 8, 0)])
def test_nothing_doubled_is_nothing(box: Box) -> None:
    half = half_box(box)
    assert double(np.empty((half.height, half.width), np.float32), box).shape == (
        box.height, box.width,
    )  # fmt: skip
