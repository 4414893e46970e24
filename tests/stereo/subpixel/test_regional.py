"""The robust regional surface."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from navapp.stereo.subpixel import regional
from navapp.stereo.subpixel.regional import RegionalSettings, regional_support
from tests.reference.regional_reference import regional_reference

HEIGHT, WIDTH = 150, 170
Y, X = np.mgrid[:HEIGHT, :WIDTH].astype(float)
QUADRATIC = 220.0 + 0.2 * X - 0.1 * Y + 1e-3 * (X - 80) ** 2 - 7e-4 * (Y - 60) ** 2 + 3e-4 * X * Y
SMOOTH = 220.0 + 0.15 * X - 0.08 * Y + 2.0 * np.sin(X / 30.0) * np.cos(Y / 35.0)


def surface(
    disparity: np.ndarray,
    settings: RegionalSettings | None = None,
    weight: np.ndarray | None = None,
) -> np.ndarray:
    settings = settings or RegionalSettings()
    weight = np.ones(disparity.shape) if weight is None else weight
    samples, weights = (
        each[:: settings.thin, :: settings.thin].astype(np.float32) for each in (disparity, weight)
    )
    return regional_support(samples, weights, disparity.shape, settings)


def with_outliers(disparity: np.ndarray, share: float, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    size = rng.uniform(4.0, 40.0, disparity.shape) * rng.choice([-1.0, 1.0], disparity.shape)
    return np.where(rng.random(disparity.shape) < share, disparity + size, disparity)


def inner(values: np.ndarray, border: int = 8) -> np.ndarray:
    return values[border:-border, border:-border]


@pytest.mark.parametrize("radius", [12, 16])
def test_a_quadratic_is_reproduced(radius: int) -> None:
    found = surface(QUADRATIC, RegionalSettings(radius_px=radius))
    np.testing.assert_allclose(inner(found), inner(QUADRATIC), atol=0.02)
    # What lies on one side only is not trusted with all of its slope.
    np.testing.assert_allclose(found, QUADRATIC, atol=0.5)


@pytest.mark.parametrize("radius", [12, 16])
def test_gross_outliers_do_not_matter(radius: int) -> None:
    found = surface(with_outliers(QUADRATIC, 0.3), RegionalSettings(radius_px=radius))
    np.testing.assert_allclose(inner(found, radius), inner(QUADRATIC, radius), atol=0.02)


def test_a_bump_is_bridged() -> None:
    bump = np.maximum(1.0 - ((X - 84) ** 2 + (Y - 76) ** 2) / 100.0, 0.0)
    found = surface(SMOOTH + bump, RegionalSettings(radius_px=24))
    np.testing.assert_allclose(inner(found), inner(SMOOTH), atol=0.2)


def test_noise_becomes_smaller() -> None:
    noise = np.random.default_rng(2).normal(scale=0.15, size=SMOOTH.shape)
    error = surface(SMOOTH + noise, RegionalSettings(radius_px=16)) - SMOOTH
    assert np.sqrt(np.mean(error**2)) < 0.035
    assert np.abs(error).max() < 0.3


def test_holes_are_bridged_and_what_is_far_stays_unknown() -> None:
    holed = QUADRATIC.copy()
    holed[60:76, 40:56] = np.nan
    holed[:, 110:] = np.nan
    found = surface(holed)
    np.testing.assert_allclose(found[60:76, 40:56], QUADRATIC[60:76, 40:56], atol=0.05)
    np.testing.assert_allclose(inner(found)[:, :90], inner(QUADRATIC)[:, :90], atol=0.05)
    # The last node with samples enough stands 2 px beyond them, its cell another 8 px.
    assert np.isnan(found[:, 120:]).all()


# The nodes of a cell may stand on both sides; then what is between them is a mixture.
@pytest.mark.parametrize(("edge", "mixed_px"), [(84.0, 4.0), (86.5, 7.0)])
@pytest.mark.parametrize("radius", [12, 16])
def test_both_sides_of_a_step_are_right(edge: float, mixed_px: float, radius: int) -> None:
    step = SMOOTH - 20.0 * (edge < X)
    error = np.abs(surface(step, RegionalSettings(radius_px=radius)) - step)
    assert inner(error)[:, np.abs(X[0, 8:-8] - edge) > mixed_px].max() < 0.1


def test_a_wedge_keeps_its_slopes() -> None:
    # Each polynomial takes the side that most of its samples are on.
    wedge = 200.0 + 0.4 * np.abs(X - 84.0)
    error = np.abs(surface(wedge) - wedge)
    assert inner(error)[:, np.abs(X[0, 8:-8] - 84.0) > 8.0].max() < 0.1


def test_pixels_without_weight_do_not_count() -> None:
    rng = np.random.default_rng(3)
    weight = (rng.random(SMOOTH.shape) < 0.6).astype(np.float32)
    wrong = np.where(weight > 0, SMOOTH, 900.0 * rng.random(SMOOTH.shape))
    for nothing in (np.nan, np.inf):
        unknown = np.where(weight > 0, SMOOTH, nothing)
        np.testing.assert_array_equal(surface(wrong, weight=weight), surface(unknown))


def test_heavier_pixels_lead() -> None:
    # Two sheets, every other column; half a pixel is within the last scales' reach of both.
    sheets = np.where(X % 4 < 2, 100.0, 100.5)
    for heavy in (100.0, 100.5):
        weight = np.where(sheets == heavy, 1.0, 0.05).astype(np.float32)
        assert np.abs(inner(surface(sheets, weight=weight)) - heavy).max() < 0.1


@pytest.mark.kernel
@pytest.mark.parametrize(
    "settings",
    [
        RegionalSettings(),
        RegionalSettings(radius_px=10, node_px=6, thin=3, min_samples=8),
        RegionalSettings(radius_px=5, node_px=4, thin=1, scales_px=(2.0, 0.5)),
        RegionalSettings(radius_px=9, node_px=8, thin=8, scales_px=(1.0,), min_samples=6),
    ],
)
def test_the_kernels_do_what_the_reference_does(settings: RegionalSettings) -> None:
    rng = np.random.default_rng(4)
    part = np.s_[:41, :78]
    disparity = with_outliers(SMOOTH, 0.1)[part] + rng.normal(scale=0.2, size=(41, 78))
    disparity[rng.random(disparity.shape) < 0.1] = np.nan
    disparity[:, 60:] = np.nan
    weight = rng.uniform(0.3, 1.0, disparity.shape)
    weight[rng.random(disparity.shape) < 0.1] = 0.0
    samples, weights = (
        each[:: settings.thin, :: settings.thin].astype(np.float32) for each in (disparity, weight)
    )
    found = regional_support(samples, weights, disparity.shape, settings)
    expected = regional_reference(samples, weights, disparity.shape, settings)
    np.testing.assert_allclose(found, expected, atol=5e-3)
    assert np.nanmedian(np.abs(found - expected)) < 1e-4


def test_the_row_bands_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    disparity = with_outliers(SMOOTH, 0.2)
    disparity[30:80, 20:90] = np.nan
    found = surface(disparity)

    def in_bands(n_bands: int, height: int, job, **_: int) -> None:
        limits = [height * k // n_bands for k in range(n_bands + 1)]
        for band in pairwise(limits):
            job(band)

    for n_bands in (1, 3):
        monkeypatch.setattr(regional, "in_row_bands", partial(in_bands, n_bands))
        np.testing.assert_array_equal(surface(disparity), found)


@pytest.mark.parametrize("shape", [(1, 1), (5, 40), (40, 5)])
def test_small_maps(shape: tuple[int, int]) -> None:
    settings = RegionalSettings(min_samples=1)
    assert np.abs(surface(np.full(shape, 7.25), settings) - 7.25).max() < 1e-3


def test_a_map_without_any_answer_stays_unknown() -> None:
    assert np.isnan(surface(np.full((30, 40), np.nan))).all()
    nothing = np.zeros((30, 40), dtype=np.float32)
    assert np.isnan(surface(np.full((30, 40), 5.0), weight=nothing)).all()


def test_too_few_samples_have_no_surface() -> None:
    few = np.full((60, 60), np.nan)
    few[24:32, 24:32] = 50.0
    assert np.isnan(surface(few)).all()
    assert np.isfinite(surface(few, RegionalSettings(min_samples=16))).any()


def test_what_makes_no_sense_is_refused() -> None:
    samples = np.ones((75, 85), dtype=np.float32)
    with pytest.raises(ValueError, match="size"):
        regional_support(samples, samples[:3], SMOOTH.shape, RegionalSettings())
    with pytest.raises(ValueError, match="size"):
        regional_support(samples, samples, (75, 85), RegionalSettings())
    with pytest.raises(ValueError, match="divides"):
        RegionalSettings(node_px=8, thin=3)
    with pytest.raises(ValueError, match="radius"):
        RegionalSettings(radius_px=6, node_px=8)
    with pytest.raises(ValueError, match="scale"):
        RegionalSettings(scales_px=())
