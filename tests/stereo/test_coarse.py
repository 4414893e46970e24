"""The coarse surface, and which of two pictures is the left one."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.stereo import coarse, match_surface
from navapp.stereo.coarse import are_swapped
from tests.stereo.test_chains import (
    EVERY_RESOLUTION,
    FULL,
    HALF,
    HEIGHT,
    INSIDE,
    WIDTH,
    scene,
    swapped,
)


@pytest.mark.parametrize(("band_px", "divisor"), [(FULL, 1), (HALF, 2)])
def test_many_cells_are_matched_at_half_resolution(
    band_px: tuple[float, float], divisor: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def spy(pair, band_px, settings):
        asked.append((pair.left.shape, band_px))
        return match_census(pair, band_px, settings)

    match_census = coarse.match_census
    monkeypatch.setattr(coarse, "match_census", spy)
    match_surface(scene(INSIDE), band_px, fills=False)
    low, high = band_px
    assert asked == [((HEIGHT // divisor, WIDTH // divisor), (low / divisor, high / divisor))]


@EVERY_RESOLUTION
def test_the_order_of_two_pictures_is_told_by_which_way_round_they_agree(
    band_px: tuple[float, float],
) -> None:
    right_way = scene(INSIDE)
    assert not are_swapped(right_way, band_px, swapped(right_way))
    assert are_swapped(swapped(right_way), band_px, right_way)


def test_pictures_that_agree_neither_way_are_not_called_swapped() -> None:
    right_way = scene(INSIDE)
    black = replace(right_way, right=np.zeros_like(right_way.right))
    noise = np.random.default_rng(1).integers(0, 255, right_way.right.shape).astype(np.uint8)
    unrelated = replace(right_way, right=noise)
    for pair in (black, unrelated):
        assert not are_swapped(pair, FULL, swapped(pair))
        assert not are_swapped(swapped(pair), FULL, pair)
