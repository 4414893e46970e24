"""The simulated eye before the mirror: where it aims, and what it sees."""

import numpy as np
import pytest

from navapp.devices.simulated_mirror import true_display
from navapp.geometry.transform import RigidTransform
from sim_devices.aligning_eye import WANDER_SD_MM, AligningEye
from sim_devices.mirror_setups import HEIGHT_PX, WIDTH_PX, draw_setup
from sim_devices.sheet import PrintedSheet
from tests.many import few_of

SHEET = PrintedSheet(np.full((40, 40), 255, np.uint8), 1.0, -20.0, -20.0)
GREEN = slice(1, 2)


def lit_at(pixel: np.ndarray, half: int = 6) -> np.ndarray:
    picture = np.zeros((HEIGHT_PX, WIDTH_PX, 3), np.uint8)
    u, v = np.rint(pixel).astype(int)
    picture[v - half : v + half + 1, u - half : u + half + 1] = 255
    return picture


@pytest.mark.parametrize("seed", few_of(range(6), 2))
def test_a_pixel_is_found_again_in_the_direction_of_its_light(seed: int) -> None:
    setup = draw_setup(np.random.default_rng(seed))
    pixels = np.array([[100.0, 80.0], [960.0, 540.0], [1800.0, 1000.0]])
    directions = setup.directions_to_pixels(pixels, setup.eye_mm)
    np.testing.assert_allclose(
        setup.pixels_in_directions(directions, setup.eye_mm), pixels, atol=1e-6
    )


@pytest.mark.parametrize("seed", few_of(range(8), 3))
def test_the_display_is_read_as_its_model_says(seed: int) -> None:
    setup = draw_setup(np.random.default_rng(seed))
    assert setup.reads_upside_down == true_display(setup).flips_rows


def test_it_aims_as_well_as_it_can_and_wanders() -> None:
    setup = draw_setup(np.random.default_rng(3))
    true = true_display(setup)
    eye, point = AligningEye(setup, 5, 0.7), setup.site_mm + np.array([20.0, -15.0, -60.0])
    aims = np.array([eye.aim_px(point, look) for look in range(300)])
    drawn = true.project(point[None])[0]
    assert np.abs(aims.mean(axis=0) - drawn).max() < 0.5
    moved = [
        true.project(point[None], setup.eye_mm + WANDER_SD_MM * axis)[0] - drawn
        for axis in np.eye(3)
    ]
    expected = np.sqrt(0.7**2 + np.square(moved).sum(axis=0))
    assert expected.max() > 0.75
    np.testing.assert_allclose(aims.std(axis=0), expected, rtol=0.15)
    np.testing.assert_array_equal(eye.aim_px(point, 7), aims[7])


def test_light_that_is_aimed_lies_on_the_point_in_the_eyes_picture() -> None:
    setup = draw_setup(np.random.default_rng(3))
    eye, point = AligningEye(setup, 5, 0.0), setup.site_mm
    away = RigidTransform.from_parts(
        "left", "sheet", np.eye(3), setup.site_mm + np.array([5e3, 0, 0])
    )
    seen = eye.see(lit_at(eye.aim_px(point, 2)), SHEET, away, point, 2).astype(float)
    light = np.clip(seen[:, :, 1] - seen[:, :, 0] - 60.0, 0.0, None)
    v, u = np.mgrid[: seen.shape[0], : seen.shape[1]]
    middle = np.array([(u * light).sum(), (v * light).sum()]) / light.sum()
    np.testing.assert_allclose(middle, (79.5, 53.0), atol=2.5)


def test_from_afar_both_are_ringed() -> None:
    setup = draw_setup(np.random.default_rng(3))
    eye = AligningEye(setup, 5, 0.0)
    board = RigidTransform.from_parts("left", "sheet", np.eye(3), setup.site_mm)
    aim = eye.aim_px(setup.site_mm, 0)
    far = eye.see(lit_at(aim + np.array([60.0, 0.0])), SHEET, board, setup.site_mm, 0)
    assert (far == (0, 220, 255)).all(axis=2).sum() > 50
    assert (far == (80, 255, 80)).all(axis=2).sum() > 50
    near = eye.see(lit_at(aim + np.array([3.0, 0.0])), SHEET, board, setup.site_mm, 0)
    assert not (near == (0, 220, 255)).all(axis=2).any()
    dark = eye.see(np.zeros_like(lit_at(aim)), SHEET, board, setup.site_mm, 0)
    assert dark.max() > 40
