"""The paper's baseline."""

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.matching import gradient
from navapp.stereo.matching.gradient import find_winners, magnitude, match_gradient, smooth_known
from navapp.stereo.matching.search import Search
from navapp.values import Origin
from tests.reference.gradient_reference import match
from tests.stereo.pairs import HEIGHT, WIDTH, geometry, shifted_pair

INNER = Box(90, 20, 180, 80)


@pytest.mark.parametrize("box", [Box(20, 8, 16, 9), Box(3, 1, 14, 7), Box(30, 18, 10, 6)])
def test_the_winners_are_those_of_the_equations(box) -> None:
    left = np.random.default_rng(3).integers(0, 256, (24, 40), dtype=np.uint8)
    pair = RectifiedPair(left, np.roll(left, -4, axis=1), geometry(40, 24), box)
    search = Search.plan(pair, (3.0, 6.0))
    radius, n, beyond = 5, search.count, 20
    # Of all partners, also those outside the picture, with a margin.
    first = box.x - (search.lowest + n - 1)
    parts = []
    for picture, x, width in ((left, box.x, box.width), (pair.right, first, box.width + n - 1)):
        padded = np.pad(magnitude(picture).astype(np.int64), beyond, mode="edge")
        rows, columns = padded[box.y - radius + beyond :], slice(x - radius + beyond, None)
        parts.append(rows[: box.height + 2 * radius, columns][:, : width + 2 * radius])
    inside = search.right.x - first, search.right.x + search.right.width - first
    best_left, best_right = match(*parts, radius, n, inside)
    best_right = best_right[:, slice(*inside)]
    is_minimum = (best_left > 0) & (best_left < n - 1)
    found_left, found_right = find_winners(pair, search)
    expected = np.where(is_minimum, best_left + search.lowest, np.nan)
    np.testing.assert_array_equal(found_left, expected)
    expected = np.where(best_right >= 0, best_right + search.lowest, np.nan)
    np.testing.assert_array_equal(found_right, expected)
    assert (found_left == 4.0).mean() > 0.4


def test_the_magnitude_is_that_of_the_slope() -> None:
    rows, columns = np.mgrid[:8, :9]
    found = magnitude((3 * columns + 4 * rows).astype(np.uint8))
    assert (found[1:-1, 1:-1] == 5 * 16).all()


@pytest.mark.parametrize("band", [(10.0, 30.0), (19.0, 21.0), (-8.0, 25.0), (19.6, 60.0)])
def test_a_constant_shift_is_found_wherever_the_band_begins(band) -> None:
    found = match_gradient(shifted_pair(np.full((HEIGHT, WIDTH), 20.0), INNER), band).left
    assert found.matched_fraction > 0.98
    matched = found.disparity_px[found.origin == Origin.MATCHED]
    assert np.percentile(np.abs(matched - 20.0), 99) < 0.05
    assert (found.sigma_px[found.origin == Origin.MATCHED] == np.float32(0.5)).all()


def test_a_slant_is_followed_in_whole_pixels_that_the_filter_smooths() -> None:
    truth = np.broadcast_to(25.0 + 0.06 * np.arange(WIDTH), (HEIGHT, WIDTH)).copy()
    pair = shifted_pair(truth, INNER)
    inside = truth[INNER.y : INNER.y + INNER.height, INNER.x : INNER.x + INNER.width]
    raw_px = match_gradient(pair, (15.0, 60.0)).left.disparity_px
    smooth_px = smooth_known(raw_px, 1.0)
    known = np.isfinite(raw_px)
    assert (raw_px[known] == np.rint(raw_px[known])).all()
    assert (np.isfinite(smooth_px) == known).all()
    assert known.mean() > 0.9
    rms = [np.sqrt(np.nanmean((found - inside) ** 2)) for found in (raw_px, smooth_px)]
    assert rms[1] < rms[0] < 0.5


def test_partners_outside_the_picture_are_never_matched() -> None:
    whole = Box(-10, -5, WIDTH + 30, HEIGHT + 10)
    found = match_gradient(shifted_pair(np.full((HEIGHT, WIDTH), 30.0), whole), (10.0, 50.0)).left
    assert found.disparity_px.shape == (whole.height, whole.width)
    is_matched = found.origin == Origin.MATCHED
    columns = np.arange(whole.x, whole.x + whole.width)
    assert not is_matched[:, (columns < 11) | (columns >= WIDTH)].any()
    assert not is_matched[:5].any()
    assert not is_matched[-5:].any()
    assert is_matched[5:-5, (columns > 36) & (columns < WIDTH - 6)].mean() > 0.97


@pytest.mark.parametrize("dark", ["both", "left", "right"])
@pytest.mark.parametrize("grey", [0, 255])
def test_a_picture_without_contrast_matches_nowhere(grey, dark) -> None:
    pair = shifted_pair(np.full((HEIGHT, WIDTH), 20.0), INNER)
    for name in ("left", "right"):
        if dark in (name, "both"):
            getattr(pair, name)[:] = grey
    assert match_gradient(pair, (10.0, 40.0)).left.matched_fraction == 0.0


def test_the_filter_keeps_unknown_pixels_unknown_and_gives_them_no_weight() -> None:
    values = np.full((20, 20), np.nan, dtype=np.float32)
    values[:, :9] = 7.0
    values[4, 15] = 100.0
    smooth = smooth_known(values, 1.5)
    assert (np.isfinite(smooth) == np.isfinite(values)).all()
    np.testing.assert_allclose(smooth[:, :9], 7.0, rtol=1e-5)
    assert smooth[4, 15] == pytest.approx(100.0)


@pytest.mark.parametrize("box", [Box(10, 10, 0, 20), Box(WIDTH + 5, 0, 40, 20)])
def test_a_box_without_pixels_gives_an_unknown_map(box) -> None:
    found = match_gradient(shifted_pair(np.full((HEIGHT, WIDTH), 20.0), box), (10.0, 40.0)).left
    assert found.disparity_px.shape == (box.height, box.width)
    assert found.matched_fraction == 0.0


def test_bad_input_is_refused() -> None:
    pair = shifted_pair(np.full((HEIGHT, WIDTH), 20.0), INNER, is_colour=True)
    with pytest.raises(ValueError, match="grey"):
        match_gradient(pair, (10.0, 40.0))


@pytest.mark.data
def test_the_baseline_on_a_real_scene_is_what_the_paper_builds_on(data, monkeypatch) -> None:
    import cv2

    folder = data / "stereo" / "cones"
    left, right = (cv2.imread(str(folder / name), 0) for name in ("im2.png", "im6.png"))
    truth = cv2.imread(str(folder / "disp2.png"), 0) / 4.0
    height, width = left.shape
    pair = RectifiedPair(left, right, geometry(width, height), Box(0, 0, width, height))
    monkeypatch.setattr(gradient, "_RADIUS_PX", 4)
    found = match_gradient(pair, (0.0, 63.0)).left
    is_known = (truth > 0.0) & np.isfinite(found.disparity_px)
    assert is_known.sum() > 0.8 * (truth > 0.0).sum()
    assert (np.abs(found.disparity_px - truth)[is_known] > 1.0).mean() < 0.12
