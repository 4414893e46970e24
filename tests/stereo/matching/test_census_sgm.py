"""Census matching with semi-global aggregation."""

import threading

import numpy as np
import pytest

from navapp.geometry.bands import in_row_bands, pool, run_both
from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.matching.census_sgm import CensusSettings, TwoViewDisparity, match_census
from navapp.values import Origin
from tests.stereo.pairs import HEIGHT, WIDTH, geometry, shifted_pair, texture

INNER = Box(90, 20, 180, 80)
WHOLE = Box(0, 0, WIDTH, HEIGHT)
BAND = (10.0, 40.0)


def constant(value: float) -> np.ndarray:
    return np.full((HEIGHT, WIDTH), value)


def matched(found: TwoViewDisparity) -> np.ndarray:
    return found.left.origin == Origin.MATCHED


def in_box(truth: np.ndarray, box: Box = INNER) -> np.ndarray:
    return truth[box.y : box.y + box.height, box.x : box.x + box.width]


def same(a: TwoViewDisparity, b: TwoViewDisparity) -> bool:
    return all(
        np.array_equal(p, q, equal_nan=True)
        for p, q in (
            (a.left.disparity_px, b.left.disparity_px),
            (a.right_px, b.right_px),
            (a.confidence, b.confidence),
        )
    )


# Synthetic pairs


@pytest.mark.parametrize("disparity", [20.0, 33.4, 20.5])
def test_a_constant_shift_is_found(disparity) -> None:
    found = match_census(shifted_pair(constant(disparity), INNER), BAND)
    assert found.left.disparity_px.shape == (INNER.height, INNER.width)
    assert (found.left.x, found.left.y) == (INNER.x, INNER.y)
    assert found.left.matched_fraction > 0.98
    assert found.agreement > 0.98
    error = np.abs(found.left.disparity_px - disparity)[matched(found)]
    # The parabola leans towards whole pixels.
    assert np.median(error) < 0.25
    assert np.percentile(error, 99) < 0.6


def test_a_slant_is_followed_within_its_claimed_sigma() -> None:
    truth = np.broadcast_to(25.0 + 0.06 * np.arange(WIDTH), (HEIGHT, WIDTH)).copy()
    found = match_census(shifted_pair(truth, INNER), (15.0, 60.0))
    error = (found.left.disparity_px - in_box(truth))[matched(found)]
    assert found.left.matched_fraction > 0.97
    assert abs(np.median(error)) < 0.05
    assert np.sqrt(np.mean(error**2)) < CensusSettings().sigma_px
    assert (found.left.sigma_px[matched(found)] == np.float32(0.2)).all()


@pytest.mark.parametrize("band", [(28.0, 32.0), (0.0, 31.0), (29.5, 90.0), (-20.0, 40.0)])
def test_the_answer_does_not_depend_on_where_the_band_begins(band) -> None:
    found = match_census(shifted_pair(constant(30.0), INNER), band)
    assert found.left.matched_fraction > 0.97
    assert np.percentile(np.abs(found.left.disparity_px[matched(found)] - 30.0), 98) < 0.3


def test_a_negative_disparity_is_found_too() -> None:
    found = match_census(shifted_pair(constant(-12.0), INNER), (-30.0, -2.0))
    assert found.left.matched_fraction > 0.97
    assert np.nanmedian(found.left.disparity_px) == pytest.approx(-12.0, abs=0.05)


def test_a_surface_outside_the_band_is_not_claimed() -> None:
    found = match_census(shifted_pair(constant(70.0), INNER), (10.0, 30.0))
    # What chance finds are patches far apart.
    assert found.left.matched_fraction < 0.15
    assert found.agreement < 0.15


def test_the_right_view_tells_the_same_from_its_own_columns() -> None:
    truth = constant(24.0)
    found = match_census(shifted_pair(truth, INNER), BAND)
    first = INNER.x - 24 - found.right_x0
    partners = found.right_px[:, first : first + INNER.width]
    assert found.right_px.shape[0] == INNER.height
    assert (partners == 24.0).mean() > 0.98
    # Every partner of every pixel of the box is there.
    assert found.right_x0 <= INNER.x - BAND[1]
    assert found.right_x0 + found.right_px.shape[1] >= INNER.x + INNER.width - BAND[0]


def step_scene() -> tuple[RectifiedPair, np.ndarray, np.ndarray]:
    """A near square over a background: pair, disparity of the left view, what only it sees."""
    near, far = 40, 20
    back = texture(WIDTH + 100, HEIGHT, 1)
    front = texture(WIDTH + 100, HEIGHT, 2)
    right, left = back[:, :WIDTH].copy(), np.empty((HEIGHT, WIDTH))
    left[:, far:] = back[:, : WIDTH - far]
    left[:, :far] = texture(far, HEIGHT, 3)
    disparity = np.full((HEIGHT, WIDTH), float(far))
    rows, square = slice(30, 90), slice(140, 200)
    right[rows, 140 - near : 200 - near] = front[rows, square]
    left[rows, square] = front[rows, square]
    disparity[rows, square] = near
    occluded = np.zeros((HEIGHT, WIDTH), dtype=bool)
    # The square covers right columns 100 .. 159; the background seen there lies 20 further.
    occluded[rows, 100 + far : 140] = True
    views = [np.clip(view, 0, 255).astype(np.uint8) for view in (left, right)]
    return RectifiedPair(*views, geometry(), Box(60, 10, 220, 100)), disparity, occluded


def test_what_a_near_square_hides_from_the_right_camera_is_not_matched() -> None:
    pair, truth, occluded = step_scene()
    found = match_census(pair, BAND)
    is_hidden = in_box(occluded, pair.box)
    assert matched(found)[is_hidden].mean() < 0.12
    is_seen = ~is_hidden
    assert matched(found)[is_seen].mean() > 0.93
    error = np.abs(found.left.disparity_px - in_box(truth, pair.box))
    assert (error[is_seen & matched(found)] > 1.0).mean() < 0.01


def test_a_difference_in_gain_changes_nothing() -> None:
    pair = shifted_pair(constant(24.0), INNER)
    # Half as bright and twice as bright of the same whole numbers: the order of greys is the same.
    dim = RectifiedPair(pair.left // 2, pair.right // 2, pair.geometry, INNER)
    uneven = RectifiedPair(dim.left, dim.right * 2, pair.geometry, INNER)
    a, b = match_census(dim, BAND), match_census(uneven, BAND)
    assert np.array_equal(a.left.disparity_px, b.left.disparity_px, equal_nan=True)
    assert a.left.matched_fraction > 0.97
    rounded = np.round(0.7 * pair.right + 20.0).astype(np.uint8)
    c = match_census(RectifiedPair(pair.left, rounded, pair.geometry, INNER), BAND)
    assert np.percentile(np.abs(c.left.disparity_px[matched(c)] - 24.0), 99) < 0.3
    assert c.left.matched_fraction > 0.97


@pytest.mark.parametrize("dark", ["both", "left", "right"])
@pytest.mark.parametrize("grey", [0, 255])
def test_a_picture_without_contrast_answers_nothing(grey, dark) -> None:
    pair = shifted_pair(constant(20.0), INNER)
    for name in ("left", "right"):
        if dark in (name, "both"):
            getattr(pair, name)[:] = grey
    found = match_census(pair, BAND)
    assert found.left.matched_fraction == 0.0
    assert not found.confidence.any()
    assert np.isnan(found.left.disparity_px).all()
    assert not found.agreement > 0.0


def test_a_saturated_patch_is_unknown_and_confidence_follows_the_texture() -> None:
    pair = shifted_pair(constant(20.0), INNER)
    pair.left[40:70, 150:190], pair.right[40:70, 130:170] = 255, 255
    found = match_census(pair, BAND)
    assert not matched(found)[25:45, 65:95].any()
    assert (found.confidence[~matched(found)] == 0.0).all()
    assert found.confidence[matched(found)].min() > 0.0
    assert found.confidence.max() <= 1.0
    weak = RectifiedPair(100 + pair.left // 24, 100 + pair.right // 24, pair.geometry, INNER)
    faint = match_census(weak, BAND)
    assert np.median(faint.confidence[matched(faint)]) < 0.5 * np.median(
        found.confidence[matched(found)]
    )


def test_a_pattern_that_repeats_within_the_band_is_not_matched() -> None:
    pair = shifted_pair(constant(24.0), INNER)
    period = texture(12, HEIGHT)
    stripes = np.clip(np.tile(period, (1, WIDTH // 12 + 1))[:, :WIDTH], 0, 255).astype(np.uint8)
    found = match_census(RectifiedPair(stripes, stripes, pair.geometry, INNER), BAND)
    assert found.left.matched_fraction < 0.02
    ambiguous = match_census(
        RectifiedPair(stripes, stripes, pair.geometry, INNER),
        BAND,
        CensusSettings(min_uniqueness=0),
    )
    assert ambiguous.left.matched_fraction > 0.5
    assert np.median(ambiguous.confidence) < 0.05


def test_exchanged_pictures_hardly_agree() -> None:
    pair = shifted_pair(constant(24.0), INNER)
    swapped = match_census(RectifiedPair(pair.right, pair.left, pair.geometry, INNER), BAND)
    assert swapped.agreement < 0.1
    assert match_census(pair, BAND).agreement > 0.97


# Where the box lies


def test_at_the_left_border_nothing_without_a_partner_is_matched() -> None:
    found = match_census(shifted_pair(constant(30.0), WHOLE), (10.0, 50.0))
    columns = np.arange(WIDTH)
    assert not (columns - found.left.disparity_px < -0.5).any()
    assert matched(found)[:, :28].mean() < 0.1
    # No column is lost beside it.
    assert matched(found)[:, 33:300].mean() > 0.97
    assert found.right_x0 == 0


@pytest.mark.parametrize(
    "box", [Box(-20, -10, 150, 60), Box(250, 80, 100, 60), Box(-5, -5, 400, 200)]
)
def test_pixels_of_a_box_beyond_the_picture_stay_unknown(box) -> None:
    found = match_census(shifted_pair(constant(20.0), box), BAND)
    shape = (box.height, box.width)
    assert found.left.disparity_px.shape == found.confidence.shape == shape
    assert found.right_px.shape[0] == box.height
    rows = np.arange(box.y, box.y + box.height)[:, None]
    columns = np.arange(box.x, box.x + box.width)[None, :]
    is_inside = (rows >= 0) & (rows < HEIGHT) & (columns >= 0) & (columns < WIDTH)
    assert not matched(found)[~is_inside].any()
    is_safe = is_inside & (columns > 24) & (columns < WIDTH - 4)
    assert matched(found)[is_safe].mean() > 0.97
    error = np.abs(found.left.disparity_px - 20.0)[is_safe & matched(found)]
    assert np.percentile(error, 99) < 0.3


def test_the_picture_around_the_box_does_not_move_its_inside() -> None:
    pair = shifted_pair(constant(24.0), INNER)
    larger = RectifiedPair(pair.left, pair.right, pair.geometry, INNER.grow(10))
    a = match_census(pair, BAND).left.disparity_px[5:-5, 5:-5]
    b = match_census(larger, BAND).left.disparity_px[15:-15, 15:-15]
    assert np.nanpercentile(np.abs(a - b), 99) < 0.1


@pytest.mark.parametrize(
    ("box", "band"),
    [
        (Box(10, 10, 0, 20), BAND),
        (Box(10, 10, 20, 0), BAND),
        (Box(WIDTH + 5, 0, 40, 20), BAND),
        (INNER, (600.0, 700.0)),
    ],
)
def test_no_pixel_with_a_partner_gives_an_unknown_map(box, band) -> None:
    found = match_census(shifted_pair(constant(20.0), box), band)
    assert found.left.disparity_px.shape == (box.height, box.width)
    assert found.right_px.shape == (box.height, 0)
    assert found.left.matched_fraction == 0.0
    assert np.isnan(found.agreement)


# Refusals, repeatability, threads


@pytest.mark.parametrize("band", [(5.0, 5.0), (6.0, 5.0), (np.nan, 5.0), (1.0, np.inf)])
def test_a_band_that_is_none_is_refused(band) -> None:
    with pytest.raises(ValueError, match="band"):
        match_census(shifted_pair(constant(20.0), INNER), band)


def test_too_many_disparities_or_cells_are_refused_with_their_numbers() -> None:
    with pytest.raises(ValueError, match="1203 disparities; at most 1024"):
        match_census(shifted_pair(constant(20.0), INNER), (0.0, 1200.0))
    large = np.zeros((1600, 2400), dtype=np.uint8)
    pair = RectifiedPair(large, large, geometry(2400, 1600), Box(0, 0, 2400, 1600))
    with pytest.raises(ValueError, match=r"2400x1600 px with 903 disparities needs 3.3 GiB"):
        match_census(pair, (0.0, 900.0))


def test_pictures_of_another_kind_are_refused() -> None:
    colour = shifted_pair(constant(20.0), INNER, is_colour=True)
    with pytest.raises(ValueError, match="grey"):
        match_census(colour, BAND)
    pair = shifted_pair(constant(20.0), INNER)
    with pytest.raises(ValueError, match="differ in size"):
        match_census(RectifiedPair(pair.left, pair.right[:-1], pair.geometry, INNER), BAND)


@pytest.mark.parametrize(
    "wrong",
    [{"radius_x": 4, "radius_y": 4}, {"radius_x": 0, "radius_y": 0}, {"p1": 50}, {"p2": 192}],
)
def test_settings_that_would_overflow_are_refused(wrong) -> None:
    with pytest.raises(ValueError, match=r"census window|penalties"):
        CensusSettings(**wrong)


def test_the_largest_penalties_do_not_overflow() -> None:
    settings = CensusSettings(radius_x=4, radius_y=3, p1=190, p2=191)
    found = match_census(shifted_pair(constant(20.0), INNER), BAND, settings)
    assert np.percentile(np.abs(found.left.disparity_px[matched(found)] - 20.0), 98) < 0.6
    assert found.left.matched_fraction > 0.9


def test_the_same_pictures_give_the_same_answer() -> None:
    pair = step_scene()[0]
    assert same(match_census(pair, BAND), match_census(pair, BAND))


def test_the_pool_is_shared_and_two_jobs_run_side_by_side() -> None:
    assert pool() is pool()
    meeting = threading.Barrier(2, timeout=10.0)
    run_both(meeting.wait, meeting.wait)
    for height in (7, 32):
        seen: list[range] = []
        in_row_bands(height, lambda band, seen=seen: seen.append(range(*band)))
        assert len(seen) == 2
        # Every row once.
        assert sorted(row for rows in seen for row in rows) == list(range(height))


def test_an_error_in_one_of_two_jobs_is_raised() -> None:
    def fail() -> None:
        raise KeyError("gone")

    with pytest.raises(KeyError, match="gone"):
        run_both(lambda: None, fail)


@pytest.mark.data
def test_a_real_scene_is_matched_densely_and_rightly(data) -> None:
    import cv2

    folder = data / "stereo" / "cones"
    left, right = (cv2.imread(str(folder / name), 0) for name in ("im2.png", "im6.png"))
    truth, right_truth = (
        cv2.imread(str(folder / name), 0) / 4.0 for name in ("disp2.png", "disp6.png")
    )
    height, width = left.shape
    pair = RectifiedPair(left, right, geometry(width, height), Box(0, 0, width, height))
    found = match_census(pair, (0.0, 63.0))
    partner = np.rint(np.arange(width) - truth).astype(int)
    seen = np.take_along_axis(right_truth, np.clip(partner, 0, width - 1), axis=1)
    is_visible = (truth > 0.0) & (partner >= 0) & (np.abs(seen - truth) <= 1.0)
    is_judged = is_visible & matched(found)
    error = np.abs(found.left.disparity_px - truth)
    assert is_judged.sum() >= 0.94 * is_visible.sum()
    assert (error[is_judged] > 1.0).mean() <= 0.02
    swapped = match_census(RectifiedPair(right, left, pair.geometry, pair.box), (0.0, 63.0))
    assert swapped.agreement < 0.05 < 0.8 < found.agreement
