"""The display from views of a camera at the eye's place, beside the truth of the simulator."""

import dataclasses

import numpy as np
import pytest

from calibration.mirror.display_acceptance import DisplayLimits, Found, judge
from calibration.mirror.display_solution import DisplayCalibration, solve_display
from calibration.mirror.first_state import Told
from calibration.mirror.seen_views import SeenView
from navapp.devices.simulated_mirror import true_display
from navapp.errors import ResultError
from navapp.geometry.display_model import DisplayModel
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_setups import PITCH_MM, draw_setup
from tests.calibration.mirror.simulated_views import drawn_views, scene
from tests.geometry.test_display_model_errors import seen_beside_mm
from tests.many import few_of

TOLD = Told(PITCH_MM * 1.001, 2.5)


def some_views(seed: int, n: int = 6) -> tuple[MirrorSetup, list[SeenView], np.ndarray]:
    rng = np.random.default_rng(seed)
    setup = draw_setup(rng)
    return setup, *drawn_views(rng, setup, n, every=8)


def truth_of(setup: MirrorSetup, eye_mm: np.ndarray) -> DisplayModel:
    return dataclasses.replace(true_display(setup), eye_mm=eye_mm)


@pytest.mark.parametrize("seed", few_of(range(8), 2))
def test_what_is_drawn_appears_where_it_should(seed: int) -> None:
    setup, views, eye = some_views(seed)
    shares: list[float] = []
    found = solve_display(scene(), views, TOLD, on_progress=shares.append)
    true, points = truth_of(setup, eye), found.anatomy_mm
    errors = seen_beside_mm(found.model, true, points, points)
    assert np.quantile(errors, 0.95) < 0.03
    assert np.mean(errors < 3.0 * found.predicted_mm) > 0.95
    assert found.predicted_mm.max() < 0.05
    assert np.linalg.norm(found.model.eye_mm - eye) < 5.0
    quality = found.model.quality
    assert quality is not None
    assert quality.is_accepted, quality.reasons
    assert quality.figures["held_out_mm"] < 0.1
    flips = (found.model.flips_columns, found.model.flips_rows)
    assert flips == (true.flips_columns, true.flips_rows)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


@pytest.mark.release
def test_without_marked_views_the_eye_is_where_the_first_ones_were() -> None:
    _, views, eye = some_views(3)
    unmarked = [dataclasses.replace(view, is_eye=False) for view in views]
    found = solve_display(scene(), unmarked, TOLD)
    assert np.linalg.norm(found.model.eye_mm - eye) < 5.0


def test_a_view_in_which_something_moved_is_dropped_and_told() -> None:
    _, views, _ = some_views(4)
    screen = views[2].eye_screen
    moved = dataclasses.replace(screen, pixels=screen.pixels + np.array([6.0, 2.0]))
    views[2] = dataclasses.replace(views[2], eye_screen=moved)
    views[4] = dataclasses.replace(views[4], is_mirrored=not views[4].is_mirrored)
    found = solve_display(scene(), views, TOLD)
    assert {one.index for one in found.dropped} == {2, 4}
    assert {one.reason.split(":")[-1] for one in found.dropped} == {
        " something moved between its pictures",
        "the pattern is seen the other way round than in the other views",
    }
    assert found.model.quality is not None
    assert found.model.quality.reasons == ("only 4 views can be used, 6 are needed",)


@pytest.mark.release
def test_the_pitch_is_found_when_it_is_not_told() -> None:
    setup, views, _ = some_views(5, 8)
    found: DisplayCalibration = solve_display(scene(), views, Told())
    assert found.model.screen.pitch_mm == pytest.approx(setup.panel.pitch_mm, rel=0.01)


@pytest.mark.release
def test_a_curved_panel_is_found_when_it_is_asked_for() -> None:
    rng = np.random.default_rng(9)
    setup = draw_setup(rng)
    true = true_display(setup)
    panel = true.screen.resize(true.screen.pitch_mm, 6.0)
    views, eye = drawn_views(rng, setup, 6, every=8, panel=panel)
    found = solve_display(scene(), views, TOLD, with_bulge=True)
    assert found.model.screen.bulge_mm == pytest.approx(6.0, abs=0.5)
    true = dataclasses.replace(true, screen=panel, eye_mm=eye)
    errors = seen_beside_mm(found.model, true, found.anatomy_mm, found.anatomy_mm)
    assert np.quantile(errors, 0.95) < 0.03
    flat = solve_display(scene(), views, TOLD)
    assert flat.rms_px > 1.1 * found.rms_px


def test_two_views_are_too_few() -> None:
    with pytest.raises(ResultError, match="only 2 views"):
        solve_display(scene(), some_views(6)[1][:2], TOLD)


GOOD = Found(8, True, 0.1, 0.1, 0.8, 0.1, 0.8)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"n_views": 5}, "only 5 views"),
        ({"rms_px": 0.7}, "fit badly"),
        ({"is_settled": False}, "come to rest"),
        ({"held_out_mm": 0.31}, "held-out views are off 0.31 mm"),
        ({"held_out_arcmin": float("nan")}, "held-out views"),
        ({"predicted_arcmin": 2.1}, "predicted 95 % error is 0.10 mm"),
    ],
)
def test_each_limit_that_is_missed_is_told(change: dict[str, float], said: str) -> None:
    assert judge(GOOD, DisplayLimits()) == []
    (reason,) = judge(dataclasses.replace(GOOD, **change), DisplayLimits())
    assert said in reason
