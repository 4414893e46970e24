import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo import measure_health
from navapp.values import DisparityMap, Origin
from tests.stereo.pairs import HEIGHT, WIDTH, geometry, texture

BOX = Box(90, 10, 210, 96)
DISPARITY_PX = 40.25


def pair(
    row_offset_px: float = 0.0, noise: float = 1.5, stretch: float = 0.0, turn_rad: float = 0.0
) -> RectifiedPair:
    """A textured plane; the right picture shows it lower by so much, taller, and turned."""
    rng = np.random.default_rng(3)
    fine = texture(4 * WIDTH, 4 * HEIGHT, 5)
    fine = cv2.GaussianBlur(fine, (0, 0), 4.0)
    fine = 128.0 + 40.0 * (fine - fine.mean()) / fine.std()

    def seen(shift_x: float, shift_y: float, is_right: bool = False) -> np.ndarray:
        columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
        if is_right:
            middle_x, middle_y = BOX.x + 0.5 * BOX.width - DISPARITY_PX, BOX.y + 0.5 * BOX.height
            shift_y = shift_y + stretch * (rows - middle_y) + turn_rad * (columns - middle_x)
        x = (4.0 * (columns + shift_x)).astype(np.float32)
        y = (4.0 * (rows - shift_y)).astype(np.float32)
        values = cv2.remap(fine.astype(np.float32), x, y, cv2.INTER_CUBIC)
        return (values + rng.normal(0.0, noise, values.shape)).clip(0, 255).astype(np.uint8)

    right = seen(DISPARITY_PX, row_offset_px, is_right=True)
    return RectifiedPair(seen(0.0, 0.0), right, geometry(), BOX)


def matched(share: float = 0.7) -> DisparityMap:
    is_matched = np.random.default_rng(1).random((BOX.height, BOX.width)) < share
    return DisparityMap(
        np.where(is_matched, DISPARITY_PX, np.nan).astype(np.float32),
        np.where(is_matched, 0.1, np.nan).astype(np.float32),
        np.where(is_matched, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8),
        BOX.x,
        BOX.y,
    )


@pytest.mark.parametrize("row_offset_px", [0.0, 0.2, -0.5, 1.0, -1.5])
def test_the_row_offset_is_found_within_its_own_error(row_offset_px: float) -> None:
    health = measure_health(pair(row_offset_px), matched(), DISPARITY_PX)
    assert 0.0 < health.row_offset_sigma_px < 0.02
    assert health.row_offset_px == pytest.approx(
        row_offset_px, abs=4.0 * health.row_offset_sigma_px
    )
    assert health.n_points > 60
    assert health.correlation > 0.95


@pytest.mark.parametrize("stretch", [0.0, 0.002, -0.005, 0.01])
@pytest.mark.parametrize("turn_rad", [0.0, 0.003])
def test_a_taller_picture_is_told_whether_or_not_it_is_turned(
    stretch: float, turn_rad: float
) -> None:
    health = measure_health(pair(0.3, stretch=stretch, turn_rad=turn_rad), matched(), DISPARITY_PX)
    assert 0.0 < health.row_stretch_sigma < 3e-3
    assert health.row_stretch == pytest.approx(stretch, abs=1e-4 + 0.25 * abs(stretch))


@pytest.mark.parametrize("row_offset_px", [2.5, -2.9, 4.0, 6.0, -8.0])
def test_rows_that_are_far_off_give_no_number_and_are_told(row_offset_px: float) -> None:
    health = measure_health(pair(row_offset_px), matched(), DISPARITY_PX)
    assert np.isnan(health.row_offset_px) or abs(health.row_offset_px - row_offset_px) < 0.1
    assert np.isnan(health.row_offset_px) == health.has_lost_rows


def test_rows_that_agree_are_not_lost() -> None:
    assert not measure_health(pair(1.5), matched(), DISPARITY_PX).has_lost_rows
    assert not measure_health(pair(), matched(0.0), DISPARITY_PX).has_lost_rows


def test_the_standard_error_is_that_of_repeated_noise() -> None:
    sharp = measure_health(pair(noise=1.0), matched(), DISPARITY_PX)
    noisy = measure_health(pair(noise=6.0), matched(), DISPARITY_PX)
    assert noisy.row_offset_sigma_px > 2.0 * sharp.row_offset_sigma_px
    assert abs(noisy.row_offset_px) < 4.0 * noisy.row_offset_sigma_px


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_too_few_points_say_nothing_of_the_rows(share: float) -> None:
    health = measure_health(pair(0.5), matched(share), DISPARITY_PX)
    assert np.isnan(health.row_offset_px)
    assert np.isnan(health.row_offset_sigma_px)
    assert np.isnan(health.row_stretch)


def test_without_a_map_the_light_is_measured_alone() -> None:
    known = measure_health(pair(), matched(), DISPARITY_PX)
    health = measure_health(pair(), None, DISPARITY_PX)
    assert (health.left, health.right) == (known.left, known.right)
    assert np.isnan(health.row_offset_px)
    assert health.n_points == 0


@pytest.mark.parametrize(("level", "dark", "saturated"), [(3, 1.0, 0.0), (255, 0.0, 1.0)])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_dark_or_bright_picture_is_seen(
    side: str, level: int, dark: float, saturated: float
) -> None:
    good = pair()
    bad = replace(good, **{side: np.full_like(good.left, level)})
    health = measure_health(bad, matched(), DISPARITY_PX)
    one = getattr(health, side)
    assert (one.dark_fraction, one.saturated_fraction, one.detail) == (dark, saturated, 0.0)
    other = health.right if side == "left" else health.left
    assert other.dark_fraction < 0.02
    assert other.saturated_fraction < 0.02


def test_the_right_picture_is_looked_at_where_it_shows_the_box() -> None:
    good = pair()
    right = np.zeros_like(good.right)
    first = BOX.x - round(DISPARITY_PX)
    right[:, first : first + BOX.width] = good.right[:, first : first + BOX.width]
    health = measure_health(replace(good, right=right), matched(), DISPARITY_PX)
    assert health.right.dark_fraction < 0.02


def test_a_blurred_picture_has_less_detail() -> None:
    good = pair()
    blurred = replace(good, right=cv2.GaussianBlur(good.right, (0, 0), 3.0))
    health = measure_health(blurred, matched(), DISPARITY_PX)
    same = measure_health(good, matched(), DISPARITY_PX)
    assert same.right.detail == pytest.approx(same.left.detail, rel=0.05)
    assert health.right.detail < 0.5 * health.left.detail


@pytest.mark.parametrize(("noise", "contrast"), [(0.0, 1.0), (3.0, 1.0), (1.5, 0.3)])
def test_smoothness_tells_a_blur_whatever_the_noise_and_the_contrast(noise, contrast) -> None:
    rng = np.random.default_rng(5)
    white = rng.normal(0.0, 1.0, (HEIGHT, WIDTH))

    def measure(blur_px: float) -> float:
        texture_of = cv2.GaussianBlur(white, (0, 0), blur_px)
        seen = 128.0 + 30.0 * contrast * texture_of / texture_of.std()
        picture = (seen + rng.normal(0.0, noise, seen.shape)).clip(0, 255).astype(np.uint8)
        both = replace(pair(), left=picture, right=picture)
        return measure_health(both, None, DISPARITY_PX).left.smoothness

    # Of white texture: V(d) = 1 - exp(-d^2 / 4 b^2) at rows d apart.
    for blur_px, limits in (
        (1.5, (0.2, 0.6)),
        (2.0, (0.6, 1.2)),
        (4.0, (2.2, 2.8)),
        (8.0, (3.3, 4.1)),
    ):
        assert limits[0] < measure(blur_px) < limits[1], blur_px


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("blur_px", [0.0, 0.4])
def test_noise_and_texture_as_fine_are_not_smooth(seed, blur_px) -> None:
    rng = np.random.default_rng(seed)
    fine = cv2.GaussianBlur(rng.normal(0.0, 4.0, (HEIGHT, WIDTH)), (0, 0), max(blur_px, 1e-3))
    picture = (90.0 + fine).clip(0, 255).astype(np.uint8)
    health = measure_health(replace(pair(), left=picture, right=picture), None, DISPARITY_PX)
    assert not health.left.smoothness > 1.0, "not known, or small"


def test_smoothness_is_not_known_of_a_flat_picture() -> None:
    flat = np.full((HEIGHT, WIDTH), 90, np.uint8)
    health = measure_health(replace(pair(), left=flat, right=flat), None, DISPARITY_PX)
    assert math.isnan(health.left.smoothness)


def test_light_and_gain_do_not_change_the_detail() -> None:
    good = pair(noise=0.0)
    half = replace(good, right=(good.right // 2).astype(np.uint8))
    health = measure_health(half, matched(), DISPARITY_PX)
    assert health.right.detail == pytest.approx(health.left.detail, rel=0.1)
    assert abs(health.row_offset_px) < 0.02


def test_a_box_beside_the_pictures_is_dark() -> None:
    away = replace(pair(), box=Box(WIDTH + 5, 0, 50, 50))
    health = measure_health(away, None, DISPARITY_PX)
    assert health.left.dark_fraction == 1.0
