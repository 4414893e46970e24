"""Predicted errors in a mirror, beside errors that are drawn and seen."""

import dataclasses

import numpy as np
import pytest

from navapp.geometry import display_model_errors as errors
from navapp.geometry.display_model import DisplayModel, DisplayQuality
from tests.geometry.mirrored import SITE_MM, display_of, site_points


def seen_beside_mm(
    shown: DisplayModel, true: DisplayModel, told: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """(N,) distance from points to the line on which the true eye sees what is drawn for `told`."""
    drawn = true.screen.points_mm(shown.project(told))
    seen = points if true.glass is None else true.glass.apparent_mm(points, true.eye_mm)
    lines = drawn - true.eye_mm
    lines /= np.linalg.norm(lines, axis=1, keepdims=True)
    return np.linalg.norm(np.cross(seen - true.eye_mm, lines), axis=1)


@pytest.mark.parametrize("cause", ["calibration", "eye", "points", "all"])
def test_95_percent_of_drawn_errors_stay_below_the_prediction(cause: str) -> None:
    rng = np.random.default_rng(11)
    sd = np.array([3e-4] * 3 + [0.2] * 3 + [3e-4, 0.3, 0.1, 2e-3, 2e-3] + [0.5] * 3)
    root = np.diag(sd) @ (np.eye(14) + 0.2 * rng.normal(size=(14, 14)))
    uses = {name: cause in (name, "all") for name in ("calibration", "eye", "points")}
    quality = DisplayQuality(True, covariance=root @ root.T)
    model = display_of(rng, bulge_mm=1.0, quality=quality)
    points = site_points(rng, 12)
    spread = np.diag([0.04, 0.01, 0.25]) * uses["points"]
    bound = model.predict_error(
        points, 4.0 * uses["eye"], np.repeat(spread[None], 12, axis=0), uses["calibration"]
    )
    below = []
    for _ in range(600):
        change = root @ rng.normal(size=14) * uses["calibration"]
        true = model.move(change)
        true = dataclasses.replace(
            true, eye_mm=true.eye_mm + 4.0 * uses["eye"] * rng.normal(size=3)
        )
        told = points + rng.normal(size=(12, 3)) * np.sqrt(np.diag(spread))
        below.append(seen_beside_mm(model, true, told, points) <= bound)
    assert 0.935 < np.mean(below) < 0.965


def test_63_mm_between_the_eyes_and_7_mm_of_depth_cost_the_other_eye_1_mm() -> None:
    model = display_of(np.random.default_rng(12), glass_mm=0.0)
    ray = (SITE_MM - model.eye_mm) / np.linalg.norm(SITE_MM - model.eye_mm)
    on_screen = model.screen.points_mm(model.project(SITE_MM[None]))[0]
    distance = float(np.linalg.norm(on_screen - model.eye_mm))
    point = on_screen + 7.0 * ray
    told = model.error_for_other_eye_mm(point[None])[0]
    assert told == pytest.approx(63.0 * 7.0 / distance, rel=0.05)
    known = dataclasses.replace(model, other_eye_mm=model.eye_mm - 63.0 * model.screen.across)
    assert known.error_for_other_eye_mm(point[None])[0] <= told
    assert model.error_for_other_eye_mm(on_screen[None])[0] < 1e-9


def test_a_screen_that_is_moved_as_told_is_right_for_both_eyes() -> None:
    model = display_of(np.random.default_rng(13), glass_mm=2.0)
    point = SITE_MM[None] + (0.0, 0.0, 30.0)
    away = model.screen.normal * np.sign(
        model.screen.normal @ (model.screen.middle_mm - model.eye_mm)
    )
    change = np.zeros(14)
    change[3:6] = model.screen_shift_mm(point) * away
    assert model.error_for_other_eye_mm(point)[0] > 0.5
    assert model.move(change).error_for_other_eye_mm(point)[0] < 0.05


def test_millimetres_of_a_pixel_are_its_pitch_at_the_screen() -> None:
    model = display_of(np.random.default_rng(14), glass_mm=0.0)
    on_screen = model.screen.points_mm([[960.0, 540.0]])
    scale = errors.millimetres_by_pixels(model, on_screen)
    assert np.sqrt(np.abs(np.linalg.det(scale[0]))) == pytest.approx(0.2767, rel=0.01)
