"""Sub-pixel refinement on a support."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

from navapp.geometry.bands import in_row_bands
from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.subpixel import refine as module
from navapp.stereo.subpixel.refine import RefineSettings, refine
from navapp.stereo.subpixel.refine_kernels import refine_rows
from tests.reference.refine_reference import refine_step
from tests.stereo.pairs import geometry

HEIGHT, WIDTH = 60, 150
BOX = Box(60, 8, 70, 44)


def texture(seed: int, contrast: float = 20.0) -> np.ndarray:
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(HEIGHT, WIDTH)), 1.5)
    return 120.0 + contrast * noise / noise.std()


def pair_with(disparity: np.ndarray, seed: int = 1, contrast: float = 20.0) -> RectifiedPair:
    """A right picture, and a left one that shows it moved by the disparity (H, W)."""
    right = texture(seed, contrast)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    left = map_coordinates(right, [rows, columns - disparity], order=3, mode="nearest")
    left, right = (np.clip(np.round(p), 0, 255).astype(np.uint8) for p in (left, right))
    return RectifiedPair(left, right, geometry(), BOX)


def in_box(values: np.ndarray) -> np.ndarray:
    rows, columns = slice(BOX.y, BOX.y + BOX.height), slice(BOX.x, BOX.x + BOX.width)
    return values[rows, columns].astype(np.float32)


def bands_of(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """Rows, first and after the last, of every band of every step from now on."""
    bands: list[tuple[int, int]] = []

    def spy(height: int, job, *more) -> None:
        def told(band: tuple[int, int]) -> None:
            bands.append(band)
            job(band)

        in_row_bands(height, told if job.func is module.refine_rows else job, *more)

    monkeypatch.setattr(module, "in_row_bands", spy)
    return bands


SLANT = 24.0 + 0.08 * np.arange(WIDTH)[None] + 0.05 * np.arange(HEIGHT)[:, None]


@pytest.mark.parametrize("off_px", [0.0, 0.4, -0.8, 0.8])
def test_a_slanted_surface_is_measured_without_pixel_locking(off_px: float) -> None:
    found = refine(pair_with(SLANT), in_box(SLANT + off_px), RefineSettings(n_steps=3))
    error = found.disparity_px - in_box(SLANT)
    assert np.isfinite(error).mean() > 0.85
    assert abs(np.nanmean(error)) < 0.01
    assert np.nanstd(error) < 0.06
    # Locking would show as an error that follows the fraction of the disparity.
    fraction = in_box(SLANT) % 1.0
    known = np.isfinite(error)
    wave = np.abs(np.mean(error[known] * np.exp(2j * np.pi * fraction[known])))
    assert wave < 0.01


def test_a_difference_in_gain_and_brightness_changes_nothing() -> None:
    pair = pair_with(SLANT)
    brighter = np.clip(np.round(1.2 * pair.right.astype(float) + 10.0), 0, 255).astype(np.uint8)
    other = RectifiedPair(pair.left, brighter, pair.geometry, pair.box)
    a, b = refine(pair, in_box(SLANT)), refine(other, in_box(SLANT))
    assert np.nanmedian(np.abs(a.disparity_px - b.disparity_px)) < 0.02


def test_a_surface_without_texture_answers_nothing() -> None:
    flat = np.full((HEIGHT, WIDTH), 120, dtype=np.uint8)
    found = refine(RectifiedPair(flat, flat, geometry(), BOX), in_box(SLANT))
    assert np.isnan(found.disparity_px).all()


def test_noise_alone_does_not_hand_the_support_back() -> None:
    rng = np.random.default_rng(3)
    left, right = (
        np.clip(np.round(120.0 + 2.0 * rng.normal(size=(HEIGHT, WIDTH))), 0, 255).astype(np.uint8)
        for _ in range(2)
    )
    found = refine(RectifiedPair(left, right, geometry(), BOX), in_box(SLANT))
    assert found.matched_fraction < 0.01


def test_a_support_far_from_the_truth_is_not_confirmed() -> None:
    found = refine(pair_with(SLANT), in_box(SLANT + 6.0))
    wrong = np.abs(found.disparity_px - in_box(SLANT)) > 0.5
    assert wrong.mean() < 0.02


def test_the_claimed_sigma_holds_for_noise() -> None:
    rng = np.random.default_rng(5)
    pair = pair_with(SLANT, contrast=12.0)
    noisy = [
        np.clip(np.round(p + 2.0 * rng.normal(size=p.shape)), 0, 255).astype(np.uint8)
        for p in (pair.left, pair.right)
    ]
    found = refine(
        RectifiedPair(noisy[0], noisy[1], pair.geometry, pair.box),
        in_box(SLANT),
        RefineSettings(systematic_px=0.0),
    )
    ratio = (found.disparity_px - in_box(SLANT)) / found.sigma_px
    assert 0.7 < np.nanstd(ratio) < 1.4


def test_pixels_without_support_stay_unknown() -> None:
    support = in_box(SLANT)
    support[10:20, 10:30] = np.nan
    found = refine(pair_with(SLANT), support)
    assert np.isnan(found.disparity_px[10:20, 10:30]).all()
    assert (found.origin[10:20, 10:30] == 0).all()


def test_a_support_of_another_size_and_colour_are_refused() -> None:
    pair = pair_with(SLANT)
    with pytest.raises(ValueError, match="size"):
        refine(pair, np.zeros((3, 3), dtype=np.float32))
    colour = np.repeat(pair.left[:, :, None], 3, axis=2)
    with pytest.raises(ValueError, match="grey"):
        refine(RectifiedPair(colour, colour, pair.geometry, pair.box), in_box(SLANT))


@pytest.mark.kernel
@pytest.mark.parametrize("case", ["ordinary", "holes", "empty", "one row", "at the border"])
def test_the_kernel_agrees_with_the_readable_reference(case: str) -> None:
    rng = np.random.default_rng(7)
    height, width = (1 if case == "one row" else 14), 18
    left = gaussian_filter(rng.normal(size=(height, width)), 1.0).astype(np.float32) * 40
    right = gaussian_filter(rng.normal(size=(height, 40)), 1.0).astype(np.float32) * 40
    support = np.full((height, width), 2.3, dtype=np.float32)
    offset = 0.1 * rng.random((height, width), dtype=np.float32)
    if case == "holes":
        support[rng.random((height, width)) < 0.3] = np.nan
    if case == "empty":
        support[:] = np.nan
    column = 1 if case == "at the border" else 10
    filled = 0.1 if case == "one row" else 0.5
    refined = np.empty((height, width), np.float32)
    quality = np.empty((height, width, 4), np.float32)
    half, window = height // 2, (2, 1, filled * 25)
    for rows in ((0, half), (half, height)):
        refine_rows(left, right, support, offset, column, window, rows, refined, quality)
    expected = refine_step(left, right, support, offset, column, 2, filled)
    # Where there is no support, an offset says nothing.
    for offsets in (refined, expected[0]):
        offsets[np.isnan(support)] = 0.0
    for found, wanted in zip((refined, quality), expected, strict=True):
        np.testing.assert_array_equal(np.isnan(found), np.isnan(wanted))
        # Window sums run in float32 terms.
        np.testing.assert_allclose(found, wanted, rtol=2e-3, atol=2e-3)


@pytest.mark.kernel
@pytest.mark.parametrize("stride", [2, 4, 6])
def test_with_a_stride_the_same_windows_answer_the_same(stride: int) -> None:
    pair, support = pair_with(SLANT), in_box(SLANT + 0.2)
    every = refine(pair, support, RefineSettings(n_steps=1, last_step_px=0.5))
    thin = refine(pair, support, RefineSettings(n_steps=1, last_step_px=0.5), stride)
    found, expected = thin.disparity_px, every.disparity_px[::stride, ::stride]
    # Float sums depend on the row that a band begins with.
    np.testing.assert_allclose(found, expected, atol=1e-4)


@pytest.mark.parametrize(("off_px", "n_steps"), [(0.0, 1), (0.05, 1), (0.4, 2), (0.9, 3)])
def test_samples_at_rest_take_no_further_step(
    off_px: float, n_steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    bands = bands_of(monkeypatch)
    settings = RefineSettings(n_steps=3, stops_at_rest=True, last_step_px=0.3)
    found = refine(pair_with(SLANT), in_box(SLANT + off_px), settings, 6)
    # The picture's rows are shared by two bands.
    assert len(bands) == 2 * n_steps
    assert abs(np.nanmedian(found.disparity_px - in_box(SLANT)[::6, ::6])) < 0.03


@pytest.mark.parametrize("stride", [2, 4, 6, 7])
def test_every_thread_begins_at_a_row_of_samples(
    stride: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What lies between rows of samples is told by the one above, which another may not know."""
    bands = bands_of(monkeypatch)
    height = 20 * stride
    grey = np.full((height, WIDTH), 100, dtype=np.uint8)
    pair = RectifiedPair(grey, grey, geometry(), Box(60, 0, 70, height))
    refine(pair, np.full((height, 70), 2.0, np.float32), RefineSettings(n_steps=1), stride)
    assert len(bands) == 2
    assert all(first % stride == 0 for first, _ in bands)


def test_two_threads_share_the_support_not_the_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    bands = bands_of(monkeypatch)
    support = in_box(SLANT)
    support[:20] = np.nan
    refine(pair_with(SLANT), support, RefineSettings(n_steps=1))
    # Whole blocks of eight rows.
    assert sorted(bands) == [(0, 24), (24, 44)]
    bands.clear()
    nothing = refine(pair_with(SLANT), np.full_like(support, np.nan), RefineSettings(n_steps=1))
    assert nothing.matched_fraction == 0.0


def test_a_window_over_two_surfaces_is_rough() -> None:
    step = np.where(np.arange(WIDTH)[None] < 90, 0.0, 1.6) + np.zeros((HEIGHT, 1))
    pair, support = pair_with(SLANT + step), in_box(SLANT + 0.8)
    loose = {"n_steps": 3, "last_step_px": 0.5, "min_correlation": 0.0, "max_sigma_px": 9.0}
    found = refine(pair, support, RefineSettings(**loose))
    smooth = refine(pair, support, RefineSettings(**loose, max_roughness_px=0.3))
    edge = slice(90 - BOX.x - 3, 90 - BOX.x + 3)
    assert np.isfinite(found.disparity_px[:, edge]).mean() > 0.8
    assert np.isfinite(smooth.disparity_px[:, edge]).mean() < 0.3
    assert np.isfinite(smooth.disparity_px[6:-6, 6:15]).mean() > 0.9
