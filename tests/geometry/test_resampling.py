"""Resampling of a picture at real places."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from navapp.geometry.box import Box
from navapp.geometry.resampling import find_places, resample, shift_places
from tests.reference.resample_reference import resample_slowly


def places(height: int, width: int, dx: float, dy: float) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    return columns + np.float32(dx), rows + np.float32(dy)


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.5, 0.8])
def test_a_ramp_comes_out_as_a_ramp(shift: float) -> None:
    rows, columns = np.mgrid[:40, :60]
    ramp = (2 * columns + 2 * rows).astype(np.uint8)
    found = resample(ramp, find_places(*places(40, 60, shift, -shift))).astype(float)
    error = found[3:-3, 3:-3] - ramp[3:-3, 3:-3]
    assert np.abs(error).max() <= 0.5


def test_whole_places_give_the_picture_itself() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (30, 40), dtype=np.uint8)
    found = resample(picture, find_places(*places(30, 40, 0.0, 0.0)))
    np.testing.assert_array_equal(found, picture)


@pytest.mark.parametrize(("dx", "dy"), [(-5.0, 0.0), (4.5, 0.0), (0.0, -3.0), (0.0, 6.2)])
def test_outside_the_picture_there_is_nothing(dx: float, dy: float) -> None:
    picture = np.full((30, 40), 200, dtype=np.uint8)
    columns, rows = places(30, 40, dx, dy)
    found = resample(picture, find_places(columns, rows))
    is_inside = (columns >= 0) & (columns <= 39) & (rows >= 0) & (rows <= 29)
    np.testing.assert_array_equal(found, np.where(is_inside, 200, 0))


def bent(height: int, width: int, turn: float, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Places as a turned lens that distorts asks for them."""
    rows, columns = np.mgrid[:height, :width].astype(float)
    x, y = (columns - 0.48 * width) / width, (rows - 0.52 * height) / width
    bulge = scale * (1.0 + 0.08 * (x * x + y * y))
    u = 0.5 * width + bulge * width * (np.cos(turn) * x - np.sin(turn) * y)
    v = 0.5 * height + bulge * width * (np.sin(turn) * x + np.cos(turn) * y)
    return u.astype(np.float32), v.astype(np.float32)


@pytest.mark.kernel
@pytest.mark.parametrize(("turn", "scale"), [(0.02, 1.03), (-0.05, 0.94), (0.2, 1.2)])
def test_the_kernel_agrees_with_the_readable_reference(turn: float, scale: float) -> None:
    rng = np.random.default_rng(3)
    picture = np.clip(128 + 200 * gaussian_filter(rng.normal(size=(44, 67)), 1.5), 0, 255)
    picture = picture.astype(np.uint8)
    columns, rows = bent(44, 67, turn, scale)
    found = resample(picture, find_places(columns, rows)).astype(int)
    expected = resample_slowly(picture, columns, rows)
    # The outermost pixel falls on one side of the edge or on the other.
    inside = (columns > 1) & (columns < 65) & (rows > 1) & (rows < 42)
    beyond = (columns < -1) | (columns > 67) | (rows < -1) | (rows > 44)
    # Columns first, then rows: the same to the third order, and exact on straight lines.
    assert np.abs(found - expected)[inside].max() <= 1
    assert (found == expected)[inside].mean() > 0.95
    assert (found[beyond] == 0).all()
    part = Box(13, 7, 38, 21)
    rows_of, columns_of = slice(7, 28), slice(13, 51)
    cut = resample(picture, find_places(columns, rows), part)
    np.testing.assert_array_equal(cut[rows_of, columns_of], found[rows_of, columns_of])
    assert np.count_nonzero(cut) == np.count_nonzero(cut[rows_of, columns_of])


@pytest.mark.parametrize("turn", [0.0, 0.03])
def test_shifted_rows_are_those_of_shifted_places(turn: float) -> None:
    rng = np.random.default_rng(4)
    picture = np.clip(128 + 300 * gaussian_filter(rng.normal(size=(44, 67)), 2.0), 0, 255)
    picture = picture.astype(np.uint8)
    columns, rows = bent(44, 67, turn, 1.0)
    shift_px = np.column_stack([np.linspace(-1.4, 0.9, 44), np.linspace(0.7, -0.4, 44)])
    part = Box(12, 9, 40, 25)
    moved = shift_places(find_places(columns, rows), shift_px, part)
    found = resample(picture, moved, part)
    expected = resample_slowly(
        picture, np.float32(columns + shift_px[:, :1]), np.float32(rows + shift_px[:, 1:])
    )
    apart = np.abs(found.astype(int) - expected)[part.slices]
    assert apart.max() <= 2
    assert (apart == 0).mean() > 0.9
