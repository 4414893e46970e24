"""The error budget of frames of a simulated knee, and of what cannot be seen."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from drivers.frames import StereoFrame
from navapp.evaluation.noise_limit.frame import measure_budget
from navapp.geometry.rectification import rectifier_of
from navapp.geometry.transform import RigidTransform
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World
from tests.knees import SimulatedKnee

QUIET, NOISY = SensorModel(seed=7), SensorModel(full_well_e=1250.0, read_noise_e=7.0, seed=7)
TARGETS_MM = np.array([[0.0, 0.0, 0.0], [30.0, 0.0, 0.0], [0.0, 20.0, 20.0]])


@pytest.fixture(scope="module")
def world() -> World:
    return World(Scenario(seed=7))


def budget_of(
    world: World, sensor: SensorModel, off_mm: float = 0.0, frame: StereoFrame | None = None
):
    knee = SimulatedKnee(world, sensor)
    seen = knee.frames(1)[0]
    true = knee.truth(seen)
    shift = RigidTransform.from_parts("left", "left", np.eye(3), (0.0, 0.0, off_mm))
    rectifier = rectifier_of(knee.rig)
    mesh = knee.bone.mesh
    return measure_budget(
        frame or seen, shift @ true, true, mesh, mesh.centroid_mm, TARGETS_MM, rectifier, sensor
    )


def test_each_step_is_further_off_than_noise_allows(world) -> None:
    limits_mm = []
    for sensor in (QUIET, NOISY):
        # The limit is that of root mean squares: one frame can be lucky.
        budgets = [astuple(budget_of(world, replace(sensor, seed=seed), 0.3)) for seed in (7, 8, 9)]
        limit_mm, ideal_mm, matched_mm, reached_mm = np.sqrt(np.mean(np.square(budgets), axis=0))
        assert 0.001 < limit_mm < matched_mm < 0.3
        assert ideal_mm < 0.1
        assert reached_mm == pytest.approx(0.3)
        limits_mm.append(limit_mm)
    # A sixteenth of the light has four times the noise. More pixels stay within it, which tell
    # a little more.
    assert 2.0 < limits_mm[1] / limits_mm[0] < 4.5


def test_of_dark_pictures_nothing_is_said(world) -> None:
    frame = SimulatedKnee(world, QUIET).frames(1)[0]
    dark = np.zeros_like(frame.left)
    assert budget_of(world, QUIET, frame=replace(frame, left=dark, right=dark)) is None


def test_out_of_view_nothing_is_said(world) -> None:
    knee = SimulatedKnee(world, QUIET)
    frame, mesh = knee.frames(1)[0], knee.bone.mesh
    away = RigidTransform.from_parts("left", "left", np.eye(3), (5000.0, 0.0, 0.0))
    true = away @ knee.truth(frame)
    rectifier = rectifier_of(knee.rig)
    told = measure_budget(
        frame, true, true, mesh, mesh.centroid_mm, TARGETS_MM, rectifier, QUIET
    )  # fmt: skip
    assert told is None
