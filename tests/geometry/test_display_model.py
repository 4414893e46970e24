"""A display in a mirror: where things are drawn, and the eye's view of it."""

import dataclasses

import numpy as np
import pytest

from navapp.geometry.display_model import DisplayModel, DisplayQuality
from navapp.geometry.display_model_optics import Glass, VirtualScreen
from tests.geometry.mirrored import SITE_MM, display_of, site_points

FLIPS = [(True, False), (False, True), (False, False), (True, True)]
SHAPES = [(0.0, 0.0), (3.0, 0.0), (3.0, 4.0), (0.0, -6.0)]


def test_a_flat_screen_without_glass_is_met_by_straight_lines() -> None:
    model = display_of(np.random.default_rng(1), glass_mm=0.0)
    points = site_points(np.random.default_rng(2))
    seen = model.screen.points_mm(model.project(points))
    lines = np.cross(seen - model.eye_mm, points - model.eye_mm)
    assert np.abs(lines).max() / 450.0**2 < 1e-12
    assert np.abs((seen - model.screen.origin_mm) @ model.screen.normal).max() < 1e-9


@pytest.mark.parametrize("bulge_mm", [4.0, -6.0])
def test_a_bulging_screen_is_met_where_it_bulges(bulge_mm: float) -> None:
    model = display_of(np.random.default_rng(1), glass_mm=0.0, bulge_mm=bulge_mm)
    points = site_points(np.random.default_rng(2))
    seen = model.screen.points_mm(model.project(points))
    assert np.abs(np.cross(seen - model.eye_mm, points - model.eye_mm)).max() / 450.0**2 < 1e-12


def test_the_middle_of_a_bulge_stands_out_along_the_normal_and_corners_do_not() -> None:
    screen = display_of(np.random.default_rng(1), bulge_mm=5.0).screen
    corner, middle = screen.points_mm([[0.0, 0.0], [959.5, 539.5]])
    np.testing.assert_allclose(corner, screen.origin_mm, atol=1e-9)
    np.testing.assert_allclose(middle, screen.middle_mm + 5.0 * screen.normal, atol=1e-9)


def test_a_plate_of_3_mm_at_45_degrees_shifts_the_site_by_1_mm() -> None:
    """Snell's law, written out for one ray in its plane."""
    glass = Glass(3.0, np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5)]), 1.52)
    ray = np.array([[0.0, 0.0, 1.0]])
    inside = np.arcsin(np.sin(np.pi / 4) / 1.52)
    aside = 3.0 * np.sin(np.pi / 4 - inside) / np.cos(inside)
    displaced = glass.displacements_mm(ray)[0] * np.sin(np.pi / 4)
    assert displaced == pytest.approx(aside, abs=1e-12)
    assert displaced == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("flips", FLIPS)
@pytest.mark.parametrize(("glass_mm", "bulge_mm"), SHAPES)
def test_the_view_draws_where_the_model_projects(
    flips: tuple[bool, bool], glass_mm: float, bulge_mm: float
) -> None:
    rng = np.random.default_rng(3)
    model = display_of(rng, flips=flips, glass_mm=glass_mm, bulge_mm=bulge_mm)
    points = site_points(rng)
    eye = model.eye_mm + np.array([3.0, -8.0, 5.0])
    for place in (None, eye):
        view = model.view(place)
        warped = view.warp(points)
        pixels = view.to_display_px(view.camera.project(warped))
        np.testing.assert_allclose(pixels, model.project(points, place), atol=1e-8)
        depths = view.eye_from_left.apply(points)[:, 2]
        np.testing.assert_allclose(warped[:, 2], depths, atol=1e-9)
        assert (view.camera.width, view.camera.height) == (1920, 1080)


@pytest.mark.parametrize("flips", FLIPS)
def test_pixels_of_a_picture_go_where_their_places_go(flips: tuple[bool, bool]) -> None:
    view = display_of(np.random.default_rng(4), flips=flips).view()
    image = np.zeros((1080, 1920, 3), np.uint8)
    image[200, 30] = 255
    shown = view.to_display(image)
    assert shown.flags.c_contiguous
    assert shown is not image
    ((column, row),) = view.to_display_px([[30.0, 200.0]])
    assert shown[int(row), int(column), 0] == 255


def test_without_glass_and_bulge_the_view_is_a_plain_camera() -> None:
    model = display_of(np.random.default_rng(5), glass_mm=0.0)
    points = site_points(np.random.default_rng(6))
    view = model.view()
    np.testing.assert_allclose(view.warp(points), view.eye_from_left.apply(points), atol=1e-9)


def test_what_is_behind_the_eye_is_drawn_nowhere() -> None:
    model = display_of(np.random.default_rng(5), bulge_mm=5.0)
    behind = 2.0 * model.eye_mm - SITE_MM
    assert np.isnan(model.project(behind[None])).all()
    assert np.isnan(model.view().warp(behind[None])[:, :2]).all()


def test_flips_that_do_not_go_with_the_handedness_are_refused() -> None:
    model = display_of(np.random.default_rng(7), flips=(True, False))
    with pytest.raises(ValueError, match="not on the side"):
        dataclasses.replace(model, flips_columns=False)
    with pytest.raises(ValueError, match="not on the side"):
        model.view(2.0 * model.screen.middle_mm - model.eye_mm)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"across": np.array([1.0, 0.1, 0.0])}, "orthogonal unit"),
        ({"pitch_mm": 0.0}, "positive length"),
        ({"width_px": 0}, "at least one column"),
        ({"origin_mm": np.array([0.0, np.nan, 0.0])}, "three finite"),
    ],
)
def test_impossible_screens_are_refused(changes: dict[str, object], said: str) -> None:
    screen = VirtualScreen(np.zeros(3), np.eye(3)[0], np.eye(3)[1], 0.3, 10, 10)
    with pytest.raises(ValueError, match=said):
        dataclasses.replace(screen, **changes)


def test_a_covariance_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="14x14"):
        display_of(
            np.random.default_rng(1), quality=DisplayQuality(True, covariance=np.eye(3))
        )  # fmt: skip


def test_moves_are_what_they_are_called() -> None:
    model: DisplayModel = display_of(np.random.default_rng(8), bulge_mm=1.0)
    change = np.zeros(14)
    change[3:6], change[6], change[7], change[8], change[11:] = 1.0, 0.01, 2.0, 0.5, 3.0
    moved = model.move(change)
    np.testing.assert_allclose(moved.screen.middle_mm, model.screen.middle_mm + 1.0)
    assert moved.screen.pitch_mm == pytest.approx(1.01 * model.screen.pitch_mm)
    assert moved.screen.bulge_mm == pytest.approx(3.0)
    assert moved.glass is not None
    assert moved.glass.thickness_mm == pytest.approx(3.5)
    np.testing.assert_allclose(moved.eye_mm, model.eye_mm + 3.0)
    change = np.zeros(14)
    change[:3], change[9] = model.screen.normal * 0.02, 0.03
    moved = model.move(change)
    assert moved.screen.across @ model.screen.across == pytest.approx(np.cos(0.02))
    assert moved.glass is not None
    assert model.glass is not None
    assert moved.glass.normal @ model.glass.normal == pytest.approx(np.cos(0.03))
