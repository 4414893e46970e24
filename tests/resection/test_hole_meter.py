"""The mouths of holes, in pictures of the simulated femur."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from navapp.resection import HoleMeter
from navapp.values import DrillAxis, MeasuredHole, PoseEstimate, join_measured
from sim_devices.operation import State
from sim_devices.scenario import Scenario
from sim_devices.world import World
from tests.knees import SimulatedKnee


@lru_cache(maxsize=2)
def drilled(*, is_made: bool = True):
    """A femur before its cuts, one pair of pictures, its true pose, the plan of its hole."""
    world = World(Scenario(seed=104, stage="implant", motion="still"))
    world.states.show(State("implant", frozenset({"femoral_guide"} if is_made else ())))
    knee = SimulatedKnee(world)
    (frame,) = knee.frames(1)
    entry_mm, direction = world.drill_line
    return knee, frame, knee.truth(frame), DrillAxis("femur", entry_mm, direction, 25.0, 9.0)


def measure(planned=None, sigma_mm: float = 0.0, moved_mm=(0.0, 0.0, 0.0), **words):
    knee, frame, pose, right = drilled(**words)
    pose = pose.move(np.array([*moved_mm, 0.0, 0.0, 0.0]), pose.translation_mm)
    covariance = np.diag([sigma_mm**2] * 3 + [1e-12] * 3)
    estimate = PoseEstimate(pose, covariance, 1000, 1.0, 0.1, 0.1, 1, True)
    meter = HoleMeter(knee.rig, knee.bone)
    return meter.measure(frame.left, frame.right, estimate, planned or right)


def true_offset_mm(planned: DrillAxis) -> np.ndarray:
    return planned.axes @ (drilled()[0].oracle.made_hole()[0] - planned.entry_mm)


def test_the_mouth_is_found_where_the_drill_went() -> None:
    planned = drilled()[3]
    found = measure()
    assert found.is_told
    # The drill missed its plan by 0.9 mm.
    assert np.linalg.norm(true_offset_mm(planned)) > 0.5
    off_mm = np.linalg.norm(found.offset_mm - true_offset_mm(planned))
    assert off_mm < 0.1
    assert off_mm <= found.bound_mm
    assert found.diameter_mm == pytest.approx(9.0, abs=0.3)
    assert abs(found.diameter_mm - 9.0) <= found.diameter_bound_mm
    vertices_mm = drilled()[0].bone.mesh.vertices_mm
    assert np.linalg.norm(vertices_mm - found.entry_mm, axis=1).min() < 1.5


@pytest.mark.release
def test_a_plan_further_off_finds_the_same_mouth() -> None:
    planned = drilled()[3]
    aside = replace(planned, entry_mm=planned.entry_mm + 2.0 * planned.axes[0])
    found = measure(aside)
    np.testing.assert_allclose(found.offset_mm, true_offset_mm(aside), atol=0.15)


def test_an_error_of_the_pose_is_in_the_bound() -> None:
    exact, unsure = measure(), measure(sigma_mm=0.2)
    assert unsure.bound_mm == pytest.approx(np.hypot(exact.bound_mm, 2.45 * 0.2), rel=1e-3)
    wrong = measure(sigma_mm=0.2, moved_mm=(0.3, 0.0, 0.0))
    assert np.linalg.norm(wrong.offset_mm - true_offset_mm(drilled()[3])) <= wrong.bound_mm


def test_where_nothing_was_drilled_nothing_is_told() -> None:
    found = measure(is_made=False)
    assert found is None or not found.is_told


@pytest.mark.parametrize("change", [{"diameter_mm": 15.0}, {"diameter_mm": 5.0}])
def test_a_hole_of_another_drill_is_not_this_one(change) -> None:
    found = measure(replace(drilled()[3], **change))
    assert found is None or not found.is_told


def test_a_plan_beside_the_bone_has_no_mouth() -> None:
    planned = drilled()[3]
    assert measure(replace(planned, entry_mm=planned.entry_mm + np.array([0.0, 0.0, 90.0]))) is None


def test_measurements_are_joined() -> None:
    one = measure()
    other = replace(one, offset_mm=one.offset_mm + np.array([0.2, 0.0]))
    both = join_measured([one, other])
    assert isinstance(both, MeasuredHole)
    np.testing.assert_allclose(both.offset_mm, one.offset_mm + np.array([0.1, 0.0]))
    assert both.bound_mm < one.bound_mm
    # However many there are: what they share stays.
    many = join_measured([one] * 400)
    assert many.bound_mm == pytest.approx(2.45 * 0.08, rel=0.05)
    assert many.diameter_bound_mm == pytest.approx(1.96 * 0.16, rel=0.05)
    with pytest.raises(ValueError, match="no measurement"):
        join_measured([])
