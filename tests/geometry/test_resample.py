"""Resampling of a picture at real places."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from navapp.geometry.rectification import resampled
from tests.reference.resample_reference import resample_slowly


def places(height: int, width: int, dx: float, dy: float) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    return columns + np.float32(dx), rows + np.float32(dy)


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.5, 0.8])
def test_a_ramp_comes_out_as_a_ramp(shift: float) -> None:
    rows, columns = np.mgrid[:40, :60]
    ramp = (2 * columns + 2 * rows).astype(np.uint8)
    found = resampled(ramp, *places(40, 60, shift, -shift)).astype(float)
    error = found[3:-3, 3:-3] - ramp[3:-3, 3:-3]
    assert np.abs(error).max() <= 0.5


def test_whole_places_give_the_picture_itself() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (30, 40), dtype=np.uint8)
    found = resampled(picture, *places(30, 40, 0.0, 0.0))
    np.testing.assert_array_equal(found, picture)


def test_outside_the_picture_there_is_nothing() -> None:
    picture = np.full((30, 40), 200, dtype=np.uint8)
    columns, rows = places(30, 40, 0.0, 0.0)
    columns[5, 5], rows[6, 6], columns[7, 7], rows[8, 8] = -3.0, 40.0, np.nan, np.inf
    found = resampled(picture, columns, rows)
    assert (found[[5, 6, 7, 8], [5, 6, 7, 8]] == 0).all()


def test_the_kernel_agrees_with_the_readable_reference() -> None:
    rng = np.random.default_rng(3)
    picture = np.clip(128 + 400 * gaussian_filter(rng.normal(size=(24, 30)), 1.0), 0, 255)
    picture = picture.astype(np.uint8)
    columns = rng.uniform(-3.0, 33.0, (17, 19)).astype(np.float32)
    rows = rng.uniform(-3.0, 27.0, (17, 19)).astype(np.float32)
    found = resampled(picture, columns, rows).astype(int)
    expected = resample_slowly(picture, columns, rows)
    # A value that lies half way between two grey levels may go either way.
    assert np.abs(found - expected).max() <= 1
    assert (found == expected).mean() > 0.98
