"""The smoother: solves against matrices, and what it must leave alone."""

import numpy as np
import pytest

from navapp.stereo.occlusion.wls_smooth import pass_strength, smooth_wls
from navapp.stereo.occlusion.wls_smooth_kernels import Lines, link_rows, solve_columns
from navapp.values import DisparityMap, Origin
from tests.reference.wls_smooth_reference import smoothed_line

SHAPE = (24, 31)
COLOUR_SIGMA = 40.0


def random_map(seed: int, sigma_px: float = 0.3) -> tuple[DisparityMap, np.ndarray, np.ndarray]:
    """A map with matched, filled and unknown pixels, a picture and a confidence."""
    rng = np.random.default_rng(seed)
    disparity = (30.0 + rng.normal(0.0, 1.5, SHAPE)).astype(np.float32)
    origin = rng.choice([0, 1, 1, 1, 3], SHAPE).astype(np.uint8)
    disparity[origin == Origin.UNKNOWN] = np.nan
    sigma = np.where(origin == Origin.MATCHED, sigma_px, 5.0).astype(np.float32)
    sigma[origin == Origin.UNKNOWN] = np.nan
    picture = rng.integers(80, 110, (*SHAPE, 3)).astype(np.uint8)
    confidence = rng.random(SHAPE).astype(np.float32)
    return DisparityMap(disparity, sigma, origin, 5, 6), picture, confidence


def links() -> np.ndarray:
    return np.exp(-np.arange(766) / COLOUR_SIGMA).astype(np.float32)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("n_channels", [1, 3])
def test_rows_and_columns_are_solved_as_the_matrix_says(seed: int, n_channels: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(0.0, 2.0, SHAPE).astype(np.float32)
    unknown = rng.random(SHAPE) < 0.1
    trust = np.where(unknown, 0.0, rng.random(SHAPE) + 0.05).astype(np.float32)
    picture = rng.integers(0, 60, (*SHAPE, n_channels)).astype(np.uint8)
    across, down = np.empty_like(values), np.empty_like(values)
    disparity = np.where(unknown, np.float32(np.nan), values)
    for first, last in ((0, 9), (9, SHAPE[0])):
        link_rows(disparity, picture, links(), first, last, across, down)
    standing = np.where(unknown, np.float32(1.0), trust)
    columns = Lines(values.copy(), standing, down)
    rows = Lines(*(np.ascontiguousarray(part.T) for part in (values, standing, across)))
    solve_columns(rows, np.float32(20.0), 0, SHAPE[0])
    solve_columns(columns, np.float32(20.0), 0, 11)
    solve_columns(columns, np.float32(20.0), 11, SHAPE[1])
    for y in range(SHAPE[0]):
        expected = smoothed_line(values[y], trust[y], picture[y], COLOUR_SIGMA, 20.0)
        np.testing.assert_allclose(rows.values[:, y], expected, atol=1e-4)
    for x in range(SHAPE[1]):
        expected = smoothed_line(values[:, x], trust[:, x], picture[:, x], COLOUR_SIGMA, 20.0)
        np.testing.assert_allclose(columns.values[:, x], expected, atol=1e-4)


def test_grey_counts_as_three_equal_channels() -> None:
    before, picture, confidence = random_map(6)
    grey = np.ascontiguousarray(picture[:, :, 0])
    in_colour = smooth_wls(before, np.repeat(grey[:, :, None], 3, axis=2), confidence)
    in_grey = smooth_wls(before, grey, confidence)
    np.testing.assert_allclose(in_grey.disparity_px, in_colour.disparity_px, atol=1e-5)


def test_the_rounds_share_the_strength_from_coarse_to_fine() -> None:
    strengths = [pass_strength(63.0, k, 3) for k in (1, 2, 3)]
    assert strengths == pytest.approx([24.0, 6.0, 1.5])


def test_a_constant_stays_constant() -> None:
    before, picture, confidence = random_map(1)
    before.disparity_px[np.isfinite(before.disparity_px)] = 30.25
    after = smooth_wls(before, picture, confidence, strength=1000.0)
    known = np.isfinite(before.disparity_px)
    np.testing.assert_allclose(after.disparity_px[known], 30.25, atol=1e-5)


def test_unknown_pixels_stay_unknown_and_known_ones_known() -> None:
    before, picture, confidence = random_map(2)
    after = smooth_wls(before, picture, confidence)
    np.testing.assert_array_equal(np.isnan(after.disparity_px), np.isnan(before.disparity_px))
    np.testing.assert_array_equal(after.origin, before.origin)
    np.testing.assert_array_equal(after.sigma_px, before.sigma_px)


@pytest.mark.parametrize("strength", [10.0, 8000.0])
def test_a_matched_pixel_moves_by_no_more_than_a_part_of_its_sigma(strength: float) -> None:
    before, picture, confidence = random_map(3)
    after = smooth_wls(before, picture, confidence, strength=strength)
    matched = before.origin == Origin.MATCHED
    moved = np.abs(after.disparity_px - before.disparity_px)[matched]
    # Its sigma is 0.3 px.
    assert moved.max() <= 0.3 * 0.3 + 1e-5
    # Without the limit most would have gone further.
    assert (moved > 0.089).mean() > 0.3


def test_filled_pixels_follow_their_matched_neighbours() -> None:
    disparity = np.full((9, 30), 20.0, dtype=np.float32)
    origin = np.full((9, 30), Origin.MATCHED, dtype=np.uint8)
    disparity[:, 14:17] = 26.0
    origin[:, 14:17] = Origin.FILLED_INTERIOR
    before = DisparityMap(disparity, np.full_like(disparity, 0.2), origin, 0, 0)
    grey = np.full((9, 30), 90, dtype=np.uint8)
    after = smooth_wls(before, grey, np.ones((9, 30), dtype=np.float32))
    assert np.abs(after.disparity_px[:, 14:17] - 20.0).max() < 1.0


def test_an_edge_of_the_picture_separates() -> None:
    disparity = np.full((9, 30), 20.0, dtype=np.float32)
    disparity[:, 15:] = 26.0
    grey = np.where(disparity > 23.0, 220, 40).astype(np.uint8)
    origin = np.full((9, 30), Origin.FILLED_INTERIOR, dtype=np.uint8)
    before = DisparityMap(disparity, np.full_like(disparity, 5.0), origin, 0, 0)
    no_trust = np.zeros((9, 30), dtype=np.float32)
    after = smooth_wls(before, grey, no_trust)
    np.testing.assert_allclose(after.disparity_px, disparity, atol=0.05)
    blurred = smooth_wls(before, np.full_like(grey, 90), no_trust)
    assert np.abs(blurred.disparity_px - disparity).max() > 1.0


def test_a_map_without_any_answer_stays_unknown() -> None:
    before, picture, confidence = random_map(4)
    before.disparity_px[:] = np.nan
    before.origin[:] = Origin.UNKNOWN
    assert np.isnan(smooth_wls(before, picture, confidence).disparity_px).all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 3), (3, 40)])
def test_small_maps_are_smoothed_in_both_directions(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(7)
    disparity = (20.0 + rng.normal(0.0, 1.0, shape)).astype(np.float32)
    origin = np.full(shape, Origin.FILLED_INTERIOR, dtype=np.uint8)
    before = DisparityMap(disparity, np.full_like(disparity, 5.0), origin, 0, 0)
    grey = np.full(shape, 90, dtype=np.uint8)
    no_trust = np.zeros(shape, dtype=np.float32)
    after = smooth_wls(before, grey, no_trust, strength=1e5, n_rounds=4)
    np.testing.assert_allclose(after.disparity_px, disparity.mean(), atol=0.02)


def test_what_makes_no_sense_is_refused() -> None:
    before, picture, confidence = random_map(5)
    with pytest.raises(ValueError, match="size"):
        smooth_wls(before, picture, confidence[1:])
    with pytest.raises(ValueError, match="n_rounds"):
        smooth_wls(before, picture, confidence, n_rounds=0)
    with pytest.raises(ValueError, match="picture"):
        smooth_wls(before, picture[:, 1:], confidence)
