"""The simulated room as configured: light, lenses, distance, a cloth over the bone."""

import numpy as np
import pytest

from navapp.config import Configuration, SimulationSection
from navapp.config.camera_sections import CameraSection
from navapp.devices import open_live
from navapp.devices.simulated_room import find_cartilage_mm

SMALL = {"seed": 3, "scale": 0.25, "motion": "still", "stepped": True}


def take(n_pictures: int = 1, **settings):
    """The last left picture, and what was opened."""
    simulated = SimulationSection(**{**SMALL, **settings})
    opened = open_live(Configuration(camera=CameraSection(simulated=simulated)), is_headless=True)
    frames = [opened.devices.camera.read(1.0) for _ in range(n_pictures)]
    opened.devices.close()
    return frames[-1].left.astype(float), opened


@pytest.fixture(scope="module")
def usual():
    return take()


def test_less_light_is_darker_and_more_is_brighter(usual) -> None:
    levels = [take(light=light)[0].mean() for light in (0.1, 4.0)]
    assert levels[0] < 0.6 * usual[0].mean()
    assert levels[1] > 1.3 * usual[0].mean()


@pytest.mark.release
def test_fewer_electrons_are_more_noise(usual) -> None:
    def noise(settings) -> float:
        exact = take(full_well_e=1e9, read_noise_e=0.0)[0]
        return float(np.std(take(**settings)[0] - exact))

    assert noise({"full_well_e": 500.0}) > 3.0 * noise({})
    assert noise({"read_noise_e": 200.0}) > 2.0 * noise({})


def test_a_lens_out_of_focus_blurs(usual) -> None:
    def sharpness(picture) -> float:
        return float(np.abs(np.diff(picture, axis=1)).mean())

    assert sharpness(take(defocus_px=4.0)[0]) < 0.5 * sharpness(usual[0])


def test_the_knee_lies_as_far_away_as_it_is_told() -> None:
    _, near = take(distance_mm=350.0)
    _, far = take(distance_mm=550.0)
    poses = [one.simulation.oracle.left_from_body("femur", 0) for one in (near, far)]
    away_mm = poses[1].translation_mm - poses[0].translation_mm
    assert np.linalg.norm(away_mm) == pytest.approx(200.0, abs=0.5)
    nominal = [one.simulation.nominal_left_from_bone["femur"] for one in (near, far)]
    np.testing.assert_allclose(nominal[1].translation_mm - nominal[0].translation_mm, away_mm)


def test_the_rig_has_the_configured_baseline() -> None:
    assert take(baseline_mm=120.0)[1].rig.baseline_mm == pytest.approx(120.0)


@pytest.mark.release
@pytest.mark.parametrize(("share", "side"), [(0.3, "right"), (0.6, "left")])
def test_a_cloth_hides_its_share_of_the_bone_from_the_second_picture_on(share, side) -> None:
    open_picture, opened = take(2, side=side)
    first, _ = take(1, side=side, covered=share)
    covered, _ = take(2, side=side, covered=share)
    np.testing.assert_array_equal(first, take(1, side=side)[0])
    mesh = opened.simulation.bones["femur"]
    pose = opened.simulation.oracle.left_from_body("femur", 0)
    seen_mm = pose.apply(mesh.vertices_mm[mesh.visible_vertices(pose)])
    columns, rows = np.rint(opened.rig.left.project(seen_mm)).astype(int).T
    is_inside = (columns >= 0) & (rows >= 0) & (rows < covered.shape[0])
    is_inside &= columns < covered.shape[1]
    differs = np.abs(covered - open_picture).max(axis=2) > 0.0
    is_hidden = differs[rows[is_inside], columns[is_inside]]
    # Some pixels of the cloth are as bright as what is behind them, and lenses blur its edge.
    assert is_hidden.mean() == pytest.approx(share, abs=0.06)
    # It covers the left part of the picture, and nothing beyond its edge.
    edge = int(np.quantile(columns, share))
    assert differs[:, : edge - 3].mean() > 0.9
    assert not differs[:, edge + 4 :].any()


def test_the_true_cartilage_is_that_of_the_knee() -> None:
    thickness_mm = find_cartilage_mm(SimulationSection(seed=3, cartilage_mm=2.0), "femur")
    covered = thickness_mm[thickness_mm > 0.5]
    assert covered.mean() == pytest.approx(2.0, abs=0.3)
    assert not find_cartilage_mm(SimulationSection(seed=3), "femur").any()
