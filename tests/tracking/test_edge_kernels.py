"""Edges along normals: found where they are, and not found where there is no plain step."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from navapp.tracking.edge_kernels import (
    find_strongest_edge,
    measure_edge_offsets,
    measure_missing_fraction,
    sample_across,
)
from navapp.tracking.outline_kernels import Rim
from tests.reference import outline_reference as reference

pytestmark = pytest.mark.kernel

SIZE = 64


def picture(angle_deg: float, offset_px: float, inside: float = 180.0, outside: float = 20.0):
    """Bright up to a line `offset_px` beyond the middle, dark behind it; area sampled, blurred."""
    fine = 8
    at = (np.arange(SIZE * fine) + 0.5) / fine - 0.5 - 32.0
    x, y = np.meshgrid(at, at)
    along = x * np.cos(np.radians(angle_deg)) + y * np.sin(np.radians(angle_deg))
    sharp = np.where(along < offset_px, inside, outside)
    coarse = sharp.reshape(SIZE, fine, SIZE, fine).mean(axis=(1, 3))
    return np.round(gaussian_filter(coarse, 0.5)).astype(np.uint8)


def rim_at(angle_deg: float, x: float = 32.0, y: float = 32.0) -> Rim:
    normal = np.array([[np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))]])
    return Rim(
        np.zeros((1, 3)), np.array([[x, y]]), normal, np.ones(1), np.zeros(1, dtype=np.int32)
    )


@pytest.mark.parametrize(("angle_deg", "largest_px"), [(23.0, 0.03), (200.0, 0.03), (90.0, 0.13)])
def test_an_edge_is_found_where_it_is(angle_deg: float, largest_px: float) -> None:
    """Along rows and columns it depends a little on how it falls on the pixels."""
    offsets_px = np.arange(-1.5, 1.51, 0.25)
    pictures = [picture(angle_deg, offset_px) for offset_px in offsets_px]
    rim = rim_at(angle_deg)
    found = np.array([measure_edge_offsets(seen, rim)[0] for seen in pictures])
    assert np.abs(found - offsets_px).max() < largest_px
    assert abs((found - offsets_px).mean()) < 0.02


def test_an_edge_that_is_not_dark_enough_is_none() -> None:
    assert np.isnan(measure_edge_offsets(picture(0.0, 0.0, 180.0, 80.0), rim_at(0.0))[0])


def test_dark_inside_is_none() -> None:
    assert np.isnan(measure_edge_offsets(picture(0.0, 0.0, 20.0, 180.0), rim_at(0.0))[0])


def test_a_stronger_edge_nearby_forbids_the_weaker_one() -> None:
    seen = picture(0.0, 0.0, 100.0, 25.0).astype(int)
    seen[:, 36:] = 255
    assert np.isnan(measure_edge_offsets(seen.astype(np.uint8), rim_at(0.0))[0])


def test_nothing_is_found_in_noise_or_out_of_view() -> None:
    noise = np.random.default_rng(1).integers(0, 255, (SIZE, SIZE)).astype(np.uint8)
    rims = [rim_at(0.0, x, y) for x in np.arange(20.0, 44.0, 2.0) for y in (20.0, 31.0, 42.0)]
    found = np.concatenate([measure_edge_offsets(noise, rim) for rim in rims])
    assert np.isnan(found).all()
    assert np.isnan(measure_edge_offsets(picture(0.0, 0.0), rim_at(0.0, 3.0))[0])


def test_samples_and_levels_are_those_of_the_reference() -> None:
    seen = np.random.default_rng(2).integers(0, 255, (SIZE, SIZE)).astype(np.uint8)
    values = np.empty(17)
    for angle in (0.3, 1.9, 4.4):
        normal = (np.cos(angle), np.sin(angle))
        assert sample_across(seen, (31.3, 32.6), normal, values)
        expected = reference.profile(seen, 31.3, 32.6, normal, 8)
        np.testing.assert_allclose(values, expected, atol=1e-9)
        assert measure_missing_fraction(values) == pytest.approx(reference.missing_fraction(values))


def test_a_far_edge_is_not_near() -> None:
    at = 0.5 * np.arange(-15, 16)
    assert find_strongest_edge(np.where(at < 1.0, 100.0, 0.0)) == pytest.approx(0.75, abs=0.3)
    assert np.isnan(find_strongest_edge(np.where(at < 3.6, 100.0, 0.0)))
