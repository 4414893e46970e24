"""Half a pair's resolution, and back."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.coarse import double, double_disparity, half_box, halve
from tests.stereo.pairs import geometry


def pair_of(width: int, height: int, box: Box) -> RectifiedPair:
    left = np.random.default_rng(1).integers(0, 256, (height, width), dtype=np.uint8)
    return RectifiedPair(left, left[::-1].copy(), geometry(), box)


def test_a_pixel_of_the_half_is_the_mean_of_four() -> None:
    pair = pair_of(41, 31, Box(0, 0, 41, 31))
    half = halve(pair, (0.0, 9.0))
    four = pair.left[:30, :40].astype(float).reshape(15, 2, 20, 2).mean(axis=(1, 3))
    assert np.abs(half.left - four).max() <= 0.5
    assert half.right.shape == (15, 20)


def test_the_same_point_is_seen_at_the_matching_pixel_of_the_half() -> None:
    whole = pair_of(40, 30, Box(0, 0, 40, 30)).geometry
    half = halve(pair_of(40, 30, Box(0, 0, 40, 30)), (0.0, 9.0)).geometry
    point = np.array([[12.0, -7.0, 450.0]])
    np.testing.assert_allclose(2.0 * half.project(point) + 0.5, whole.project(point), atol=1e-9)
    assert half.disparity_px(450.0) == pytest.approx(whole.disparity_px(450.0) / 2.0)


@pytest.mark.parametrize("box", [Box(3, 4, 9, 7), Box(2, 2, 8, 8), Box(-5, -3, 12, 9)])
def test_every_pixel_of_a_box_lies_in_its_half(box: Box) -> None:
    inner = half_box(box)
    assert 2 * inner.x <= box.x
    assert 2 * (inner.x + inner.width) >= box.x + box.width
    values = np.arange(inner.height * inner.width, dtype=np.float32)
    whole = double(values.reshape(inner.height, inner.width), box)
    assert whole.shape == (box.height, box.width)
    assert whole[0, 0] == 0.0
    assert whole[-1, -1] == values[-1]


@pytest.mark.parametrize("box", [Box(10, 6, 20, 16), Box(11, 7, 21, 15)])
def test_a_slanted_disparity_keeps_its_place(box: Box) -> None:
    inner = half_box(box)
    rows, columns = np.mgrid[: inner.height, : inner.width].astype(float)
    # The half's pixel k lies at 2 k + 0.5 of the whole; its disparity is half as large.
    slanted = 20.0 + 0.1 * (2.0 * (columns + inner.x) + 0.5) + 0.04 * (2.0 * (rows + inner.y) + 0.5)
    found = double_disparity((slanted / 2.0).astype(np.float32), box)
    rows, columns = np.mgrid[: box.height, : box.width].astype(float)
    expected = 20.0 + 0.1 * (columns + box.x) + 0.04 * (rows + box.y)
    np.testing.assert_allclose(found[1:-1, 1:-1], expected[1:-1, 1:-1], atol=1e-4)


def test_unknown_pixels_do_not_spread() -> None:
    box = Box(0, 0, 12, 12)
    half = np.full((6, 6), 10.0, dtype=np.float32)
    half[2, 3] = np.nan
    found = double_disparity(half, box)
    expected = np.full((12, 12), 20.0)
    expected[4:6, 6:8] = np.nan
    np.testing.assert_array_equal(found, expected)


def test_only_what_the_box_reaches_is_made() -> None:
    pair = pair_of(400, 90, Box(240, 20, 61, 31))
    whole = halve(replace(pair, box=Box(0, 0, 400, 90)), (0.0, 30.0))
    part = halve(pair, (15.0, 30.0))
    box = part.box
    rows = slice(box.y - 4, box.y + box.height + 4)
    columns = slice(box.x - 4, box.x + box.width + 4)
    np.testing.assert_array_equal(part.left[rows, columns], whole.left[rows, columns])
    reached = slice(box.x - 34, box.x + box.width - 11)
    np.testing.assert_array_equal(part.right[rows, reached], whole.right[rows, reached])
    assert box == half_box(pair.box)
    assert (part.left[:, :100] == 0).all()
    assert (part.right[:, :70] == 0).all()
