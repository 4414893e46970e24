"""What a matcher has to search."""

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.stereo.matching.search import crop

PICTURE = np.random.default_rng(2).integers(0, 255, (20, 30)).astype(np.uint8)


@pytest.mark.parametrize("margin", [(0, 0), (3, 1)])
@pytest.mark.parametrize(
    "box",
    [
        Box(5, 6, 8, 9),
        Box(0, 0, 30, 20),
        Box(-4, -3, 9, 40),
        Box(28, 17, 6, 6),
        Box(-20, 4, 7, 5),
        Box(40, 50, 3, 4),
    ],
)
def test_beyond_the_picture_its_edge_is_repeated(box: Box, margin: tuple[int, int]) -> None:
    rows = np.arange(box.y - margin[1], box.y + box.height + margin[1]).clip(0, 19)
    columns = np.arange(box.x - margin[0], box.x + box.width + margin[0]).clip(0, 29)
    for picture in (PICTURE, PICTURE.astype(np.float32)):
        found = crop(picture, box, margin)
        np.testing.assert_array_equal(found, picture[np.ix_(rows, columns)])
        assert found.flags.c_contiguous
