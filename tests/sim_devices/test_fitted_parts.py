"""Components of one operation, on the bones that were sawn."""

import numpy as np
import pytest

from sim_devices.fitted_parts import INSERTS_MM, SEATS, FittedParts
from sim_devices.planned_cuts import RESECTION_MM
from sim_devices.sawn_bone import cut_skin
from sim_devices.scenario import Scenario
from sim_devices.world import World

SEEDS = range(1, 13)


@pytest.fixture(scope="module")
def site():
    return World(Scenario(motion="still"))._site


@pytest.fixture(scope="module")
def fitted(site):
    return FittedParts(site)


@pytest.mark.release
def test_components_are_closed_and_of_a_plausible_size(fitted) -> None:
    tray, insert = fitted.tray_and_insert
    for mesh, low, high in (
        (fitted.femoral_component, 15e3, 60e3),
        (fitted.patellar_button, 3e3, 9e3),
        (tray, 5e3, 30e3),
        (insert, 8e3, 50e3),
    ):
        assert low < mesh.volume_mm3() < high


def test_a_component_follows_the_face_that_it_sits_on(site, fitted) -> None:
    for part, name in SEATS.items():
        planned, made = site.planned[name], site.made[name]
        motion = fitted.motion_from_plan(part)
        np.testing.assert_allclose(motion.apply(planned.point_mm), made.point_mm, atol=1e-9)
        np.testing.assert_allclose(motion.rotate(planned.normal), made.normal, atol=1e-9)


@pytest.mark.release
def test_the_femoral_component_is_where_bone_was_removed(site, fitted) -> None:
    """Its joint surface is that of the joint, but for the groove and what the saw missed."""
    from scipy.spatial import cKDTree

    mesh = fitted.femoral_component
    outer = [cut.heights_mm(mesh.vertices_mm) for cut in fitted.rasped]
    outer = mesh.vertices_mm[np.max(outer, axis=0) > 4.0]
    away = cKDTree(site.bones["femur"].vertices_mm).query(outer)[0]
    assert np.median(away) < 3.0
    bone = cut_skin(site.bones["femur"], fitted.rasped)
    used = bone.vertices_mm[np.unique(bone.faces)]
    assert all(cut.heights_mm(used).max() < 1e-6 for cut in fitted.rasped)


@pytest.mark.release
@pytest.mark.parametrize("seed", SEEDS)
def test_the_insert_sets_the_gap_between_the_components(seed) -> None:
    site = World(Scenario(seed=seed, sex="male" if seed % 2 else "female"))._site
    fitted = FittedParts(site)
    # Saw misses of femur and tibia add up; the surgeon has no thinner and no thicker one.
    assert INSERTS_MM[0] < fitted.insert_mm < INSERTS_MM[-1]
    moved = fitted.femur_from_tibia.translation_mm - site.femur_from_tibia.translation_mm
    # The ligaments' gap is met to half a step of the inserts, and a step of the search.
    assert np.linalg.norm(moved) < 0.8
    thicker = fitted._close(fitted.insert_mm + 2.0)
    down = site.femur_from_tibia.rotation @ (0.0, 0.0, -1.0)
    away = (thicker.translation_mm - fitted.femur_from_tibia.translation_mm) @ down
    assert away == pytest.approx(2.0, abs=0.15)
    assert abs(fitted.insert_mm - RESECTION_MM) < 6.5
