"""Census transform."""

import numpy as np
import pytest

from navapp.stereo.matching.census_kernels import census_rows
from tests.reference.sgm_reference import census


@pytest.mark.kernel
@pytest.mark.parametrize("radius", [(1, 1), (2, 1), (0, 2), (2, 2), (3, 3)])
def test_census_bits_are_the_darker_neighbours(radius) -> None:
    image = np.random.default_rng(5).integers(0, 60, (9, 13), dtype=np.uint8)
    expected = census(image, *radius)
    n_bits = len(expected[0, 0])
    height, width = expected.shape
    codes = np.full((height, -(-n_bits // 8), width), 77, dtype=np.uint8)
    for rows in ((0, 2), (2, height)):
        census_rows(image, *radius, rows, codes)
    for y in range(height):
        for x in range(width):
            bits = "".join(str(int(bit)) for bit in expected[y, x])
            in_bytes = [int(bits[first : first + 8], 2) for first in range(0, n_bits, 8)]
            assert codes[y, :, x].tolist() == in_bytes
