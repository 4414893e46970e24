"""Pictures under masks."""

import numpy as np
import pytest

from navapp.geometry.masks import where

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("shape", [(13, 17), (1, 1), (0, 5), (5, 0)])
def test_it_answers_as_numpy(shape: tuple[int, int], dtype: type) -> None:
    mask, values, other = RNG.random(shape) < 0.4, *RNG.integers(0, 200, (2, *shape))
    values, other = values.astype(dtype), other.astype(dtype)
    for elsewhere in (other, dtype(7)):
        found = where(mask, values, elsewhere)
        assert found.dtype == dtype
        np.testing.assert_array_equal(found, np.where(mask, values, elsewhere))


def test_parts_of_pictures_and_unknown_values_are_copied_as_they_are() -> None:
    picture = RNG.random((20, 30)).astype(np.float32)
    picture[4:9] = np.nan
    part, mask = picture[3:15, 5:22], RNG.random((20, 30))[3:15, 5:22] < 0.5
    before = part.copy()
    found = where(mask, part, np.float32(np.nan))
    np.testing.assert_array_equal(found, np.where(mask, part, np.float32(np.nan)))
    np.testing.assert_array_equal(part, before)
