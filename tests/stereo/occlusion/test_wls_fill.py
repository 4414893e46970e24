"""Occlusion filling by a weighted fit: directions, limits, and what stays."""

from pathlib import Path

import numpy as np
import pytest

from navapp.geometry import bands
from navapp.stereo.occlusion.classify import classify
from navapp.stereo.occlusion.wls_fill import FillSettings, fill_wls, support_radius_px
from navapp.values import DisparityMap, Origin
from tests.bench.stereo_pairs import ALOE, CONES, Known, added_by_fill, matched
from tests.many import few_of
from tests.reference.wls_fill_reference import SlowFill
from tests.stereo.occlusion.test_classify import (
    HEIGHT,
    LEFT_COLUMNS,
    RIGHT_COLUMNS,
    ROWS,
    WIDTH,
    as_map,
    found_views,
    mirrored,
    true_views,
)


def picture_of(columns: slice) -> np.ndarray:
    picture = np.random.default_rng(2).integers(55, 65, (HEIGHT, WIDTH)).astype(np.uint8)
    picture[ROWS, columns] = 200
    return picture


def sure() -> np.ndarray:
    return np.ones((HEIGHT, WIDTH), dtype=np.float32)


def filled_left() -> tuple[DisparityMap, DisparityMap]:
    """The left view before and after."""
    before = as_map(found_views()[0])
    picture = picture_of(LEFT_COLUMNS)
    classes = classify(before, true_views()[1].astype(np.float32), 0, WIDTH, picture)
    return before, fill_wls(before, picture, sure(), classes)


def filled_right() -> DisparityMap:
    before = mirrored(as_map(found_views()[1]), WIDTH)
    other = np.ascontiguousarray(true_views()[0][:, ::-1].astype(np.float32))
    picture = np.ascontiguousarray(picture_of(RIGHT_COLUMNS)[:, ::-1])
    classes = classify(before, other, 0, WIDTH, picture)
    return mirrored(fill_wls(before, picture, sure(), classes), WIDTH)


def test_both_occlusions_of_the_left_view_continue_the_wall() -> None:
    _, after = filled_left()
    error = np.abs(after.disparity_px - true_views()[0])
    for origin in (Origin.FILLED_BORDER, Origin.FILLED_INTERIOR):
        # The other side of an interior gap would be wrong by more than ten.
        assert (after.origin == origin).sum() > 200
        assert error[after.origin == origin].max() < 1.0
    assert np.isfinite(after.disparity_px).all()


def test_both_occlusions_of_the_right_view_continue_the_wall() -> None:
    after = filled_right()
    error = np.abs(after.disparity_px - true_views()[1])
    for origin in (Origin.FILLED_BORDER, Origin.FILLED_INTERIOR):
        assert (after.origin == origin).sum() > 200
        assert error[after.origin == origin].max() < 1.0


def three_parts() -> tuple[DisparityMap, np.ndarray]:
    """A far part left of a gap, a nearer one right of it."""
    disparity = np.full((20, 60), 10.0)
    disparity[:, 30:] = 13.0
    disparity[:, 25:30] = np.nan
    return as_map(disparity, x=100), np.isnan(disparity)


@pytest.mark.parametrize(
    ("label", "expected"),
    [(Origin.FILLED_INTERIOR, 10.0), (Origin.FILLED_BORDER, 13.0), (Origin.MISMATCH_FILLED, 10.0)],
)
def test_the_class_decides_which_side_speaks(label: Origin, expected: float) -> None:
    before, gap = three_parts()
    grey = np.full(gap.shape, 80, dtype=np.uint8)
    classes = np.where(gap, label, 0).astype(np.uint8)
    settings = FillSettings(layer_px=1.0, layer_growth=0.0)
    after = fill_wls(before, grey, np.ones(gap.shape, np.float32), classes, settings)
    np.testing.assert_allclose(after.disparity_px[gap], expected, atol=1e-3)
    assert (after.origin[gap] == label).all()


def test_similar_grey_levels_speak_louder() -> None:
    before, gap = three_parts()
    before.disparity_px[:10, :25] = 11.5
    picture = np.full(gap.shape, 40, dtype=np.uint8)
    picture[10:] = 180
    classes = np.where(gap, Origin.FILLED_INTERIOR, 0).astype(np.uint8)
    after = fill_wls(before, picture, np.ones(gap.shape, np.float32), classes)
    np.testing.assert_allclose(after.disparity_px[8, 27], 11.5, atol=0.05)
    np.testing.assert_allclose(after.disparity_px[11, 27], 10.0, atol=0.05)


@pytest.mark.parametrize(("begin", "end", "jump_px"), [(24, 30, 4.5), (16, 20, 5.8)])
def test_another_layer_does_not_speak(begin: int, end: int, jump_px: float) -> None:
    """Nor does it where it stands further away, up to a slope of the layer."""
    disparity = np.full((20, 60), 10.0)
    disparity[:, begin:end] += jump_px
    disparity[:, 32:36] = np.nan
    gap = np.isnan(disparity)
    classes = np.where(gap, Origin.FILLED_INTERIOR, 0).astype(np.uint8)
    grey = np.full(gap.shape, 80, dtype=np.uint8)
    settings = FillSettings(radius_px=24)
    after = fill_wls(as_map(disparity), grey, np.ones(gap.shape, np.float32), classes, settings)
    np.testing.assert_allclose(after.disparity_px[gap], 10.0, atol=1e-4)


def test_matched_pixels_keep_every_bit() -> None:
    before, after = filled_left()
    stands = after.origin == Origin.MATCHED
    assert stands.sum() > 0.6 * stands.size
    for name in ("disparity_px", "sigma_px", "origin"):
        assert getattr(before, name)[stands].tobytes() == getattr(after, name)[stands].tobytes()


def test_filled_pixels_claim_nothing() -> None:
    _, after = filled_left()
    assert (after.sigma_px[after.origin > Origin.MATCHED] >= 5.0).all()


def test_a_withdrawn_match_is_filled_anew() -> None:
    before = as_map(np.full((20, 60), 10.0), x=100)
    before.disparity_px[:, 30:33] = 17.0
    classes = np.zeros((20, 60), dtype=np.uint8)
    classes[:, 30:33] = Origin.FILLED_INTERIOR
    grey = np.full((20, 60), 80, dtype=np.uint8)
    after = fill_wls(before, grey, np.ones((20, 60), np.float32), classes)
    np.testing.assert_allclose(after.disparity_px, 10.0, atol=1e-4)
    assert (after.origin[:, 30:33] == Origin.FILLED_INTERIOR).all()


@pytest.mark.parametrize("seed", range(5))
def test_nothing_beyond_the_permitted_sides_range_is_invented(seed: int) -> None:
    rng = np.random.default_rng(seed)
    disparity = 20.0 + 0.5 * np.arange(80) + rng.normal(0.0, 0.4, (30, 80))
    gap = slice(35, 55)
    disparity[:, gap] = np.nan
    picture = rng.integers(0, 256, (30, 80)).astype(np.uint8)
    classes = np.zeros((30, 80), dtype=np.uint8)
    classes[:, gap] = Origin.FILLED_INTERIOR
    confidence = rng.random((30, 80)).astype(np.float32)
    settings = FillSettings(slope_penalty_px2=0.1)
    after = fill_wls(as_map(disparity, x=90), picture, confidence, classes, settings)
    told = after.disparity_px[:, gap]
    assert told.min() >= np.nanmin(disparity[:, :35]) - 1.0
    assert told.max() <= np.nanmax(disparity[:, :35]) + 1.0 + 1e-4
    # The steep slope does reach the limit.
    assert told.max() > np.nanmax(disparity[:, :35])


def test_a_gap_wider_than_allowed_stays_unknown() -> None:
    line = np.full((6, 90), np.nan)
    line[:, :20] = 10.0
    classes = np.where(np.isnan(line), Origin.FILLED_INTERIOR, 0).astype(np.uint8)
    grey = np.full(line.shape, 80, dtype=np.uint8)
    after = fill_wls(
        as_map(line, x=90), grey, np.ones(line.shape, np.float32), classes,
        FillSettings(max_gap_px=15),
    )  # fmt: skip
    assert np.isfinite(after.disparity_px[:, :35]).all()
    assert np.isnan(after.disparity_px[:, 35:]).all()
    assert (after.origin[:, 35:] == Origin.UNKNOWN).all()
    assert np.isnan(after.sigma_px[:, 35:]).all()


def test_a_map_without_any_match_stays_unknown() -> None:
    nothing = as_map(np.full((20, 30), np.nan))
    classes = np.full((20, 30), Origin.MISMATCH_FILLED, dtype=np.uint8)
    grey = np.zeros((20, 30), dtype=np.uint8)
    after = fill_wls(nothing, grey, np.zeros((20, 30), np.float32), classes)
    assert np.isnan(after.disparity_px).all()
    assert (after.origin == Origin.UNKNOWN).all()


def test_the_order_of_the_shares_does_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    _, side_by_side = filled_left()
    monkeypatch.setattr(bands, "run_both", lambda first, second: (second(), first()))
    _, one_by_one = filled_left()
    assert one_by_one.disparity_px.tobytes() == side_by_side.disparity_px.tobytes()
    assert one_by_one.origin.tobytes() == side_by_side.origin.tobytes()


def test_a_jagged_edge_lets_nobody_from_the_forbidden_side_speak() -> None:
    """One row's gap reaches further under the near object than its neighbours'."""
    disparity = np.full((9, 40), 10.0, dtype=np.float32)
    disparity[:, 20:] = 30.0
    classes = np.zeros((9, 40), dtype=np.uint8)
    classes[:, 14:20] = Origin.FILLED_INTERIOR
    classes[4, 20:23] = Origin.FILLED_INTERIOR
    disparity[classes > 0] = np.nan
    grey = np.full((9, 40), 90, dtype=np.uint8)
    filled = fill_wls(as_map(disparity), grey, np.ones((9, 40), np.float32), classes)
    np.testing.assert_allclose(filled.disparity_px[classes > 0], 10.0, atol=0.1)


@pytest.mark.parametrize("n_known", [0, 1, 400])
def test_a_wide_gap_beside_few_matches_is_filled(n_known: int) -> None:
    line = np.full((7, 900), np.nan)
    line[3, :n_known] = 12.0
    classes = np.where(np.isnan(line), Origin.FILLED_INTERIOR, 0).astype(np.uint8)
    picture = np.zeros(line.shape, dtype=np.uint8)
    picture[:, n_known:] = 255
    after = fill_wls(as_map(line, x=90), picture, np.ones(line.shape, np.float32), classes)
    told = after.disparity_px[3, n_known:]
    assert np.isnan(told).all() if n_known == 0 else (abs(told - 12.0) < 1e-3).all()
    # Nothing stands on the left in the other rows.
    assert np.isnan(after.disparity_px[2]).all()


def test_a_gap_of_any_width_is_filled_from_both_sides() -> None:
    """The far side weighs by its distance from the piece, however much nearer the other one is."""
    line = np.full((7, 900), np.nan)
    line[:, :40], line[:, -40:] = 12.0, 14.0
    classes = np.where(np.isnan(line), Origin.MISMATCH_FILLED, 0).astype(np.uint8)
    grey, sure_ = np.full(line.shape, 80, np.uint8), np.ones(line.shape, np.float32)
    after = fill_wls(as_map(line), grey, sure_, classes, FillSettings(radius_px=8))
    told = after.disparity_px[3, 40:-40]
    assert ((told > 10.9) & (told < 15.1)).all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 8), (2, 8), (3, 8), (5, 2)])
def test_small_maps_are_filled(shape: tuple[int, int]) -> None:
    disparity = np.full(shape, 10.0)
    classes = np.zeros(shape, dtype=np.uint8)
    classes[:, shape[1] // 2 :] = Origin.FILLED_INTERIOR
    disparity[classes > 0] = np.nan
    grey = np.full(shape, 80, dtype=np.uint8)
    after = fill_wls(as_map(disparity, x=30), grey, np.ones(shape, np.float32), classes)
    expected = np.nan if shape[1] == 1 else 10.0
    np.testing.assert_allclose(after.disparity_px, expected, atol=1e-4)


def test_the_input_is_not_changed() -> None:
    before, _ = filled_left()
    np.testing.assert_array_equal(before.disparity_px, found_views()[0].astype(np.float32))


def test_support_grows_with_the_spread_of_disparities() -> None:
    narrow, wide = (np.linspace(10.0, high, 5000, dtype=np.float32) for high in (45.0, 200.0))
    assert 16 <= support_radius_px(narrow) < support_radius_px(wide) <= 40
    # It is the spread that counts, not how near the surface is.
    assert support_radius_px(narrow + np.float32(50.0)) == support_radius_px(narrow)


def test_sizes_that_differ_are_refused() -> None:
    before, _ = three_parts()
    grey = np.zeros((20, 60), dtype=np.uint8)
    classes = np.zeros((20, 60), dtype=np.uint8)
    with pytest.raises(ValueError, match="size"):
        fill_wls(before, grey, np.ones((19, 60), np.float32), classes)
    with pytest.raises(ValueError, match="picture"):
        fill_wls(before, grey[1:], np.ones((20, 60), np.float32), classes)


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(6))
def test_the_result_is_that_of_the_slow_reference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = (16, 90)
    disparity = np.repeat(rng.integers(10, 30, (16, 15)), 6, axis=1) + rng.normal(0, 0.4, shape)
    disparity[rng.random(shape) < 0.1] = np.nan
    picture = rng.integers(0, 256, shape).astype(np.uint8)
    confidence = rng.random(shape).astype(np.float32)
    confidence[rng.random(shape) < 0.05] = np.nan
    labels = rng.integers(Origin.FILLED_BORDER, Origin.MISMATCH_FILLED + 1, shape)
    # Wide gaps in two surfaces, of one class, whose picture is smooth but for an edge.
    disparity[8:, :] = 15.0 + 0.05 * np.arange(90) + rng.normal(0, 0.4, (8, 90))
    disparity[:8, 20:26] = disparity[8:, 22:62] = np.nan
    labels[8:, 22:62] = Origin.FILLED_INTERIOR + seed % 2
    picture[8:] = 100 + np.arange(90) // 9 + 60 * (np.arange(90) > 50)
    before = as_map(disparity, x=40)
    withdrawn = rng.random(shape) < 0.05
    classes = np.where(np.isnan(disparity) | withdrawn, labels, 0).astype(np.uint8)
    classes[:, 85:] = 0  # beyond the picture: neither matched nor to be filled
    radius = (8, 14, 34)[seed // 2]
    settings = FillSettings(radius_px=radius, max_gap_px=(None, 7)[seed % 2], slope_penalty_px2=6.0)
    after = fill_wls(before, picture, confidence, classes, settings)
    support = (classes == 0) & (before.origin == Origin.MATCHED)
    told = SlowFill(
        before.disparity_px, support, picture, confidence, classes, settings, radius
    ).told()
    np.testing.assert_allclose(after.disparity_px, told, atol=2e-4)
    assert np.isfinite(told[classes > 0]).sum() > 100


@pytest.mark.data
@pytest.mark.parametrize("known", few_of((CONES, ALOE)))
def test_the_fill_hardly_worsens_recorded_matches(data: Path, known: Known) -> None:
    answer = matched(data / "stereo", known)
    assert added_by_fill(data / "stereo", known, answer) <= 0.002
