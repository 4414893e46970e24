"""A tool in a bone's coordinates, beside numbers worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.stats import chi2, rayleigh

from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from navapp.tools.tool_on_bone import ToolOnBone, place_on_bone
from navapp.values import DrillAxis, PoseEstimate, SizedPose
from tests.tools.seen_tools import seen_at, tool_of

# The bone's x is the camera's y, its y the camera's -x.
QUARTER = rotation_from_vector((0.0, 0.0, 0.5 * np.pi))
BONE = RigidTransform.from_parts("left", "femur", QUARTER, (0.0, 0.0, 400.0))
PLATE = RigidTransform.from_parts("left", "plate", np.eye(3), (10.0, 20.0, 390.0))
HOLE = DrillAxis("femur", np.array([10.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), 30.0, 4.0)
TINY = 1e-12 * np.eye(6)


def estimate_of(covariance: FloatArray) -> PoseEstimate:
    return PoseEstimate(BONE, covariance, 1000, 1.0, 0.1, 0.1, 3, True)


def placed(
    tip_mm: ArrayLike = (3.0, -5.0, 17.0),
    axis: ArrayLike | None = None,
    by_bone: FloatArray = TINY,
    by_plate: FloatArray = TINY,
    axis_sigma_rad: float = 0.0,
) -> ToolOnBone:
    tool = tool_of(tip_mm=tip_mm, tip_sigma_mm=1e-6, axis=axis, axis_sigma_rad=axis_sigma_rad)
    return place_on_bone(
        seen_at(tool, PLATE, by_plate), "femur", estimate_of(by_bone), np.array([0.0, 0.0, 50.0])
    )


def test_the_tip_is_in_bone_coordinates() -> None:
    # In the camera (13, 15, 407), from the bone's origin (13, 15, 7).
    np.testing.assert_allclose(placed().tip_mm, [15.0, -13.0, 7.0], atol=1e-9)


def test_the_axis_is_turned_into_the_bone() -> None:
    axis = placed(axis=(0.6, 0.0, 0.8)).axis
    assert axis is not None
    np.testing.assert_allclose(axis, [0.0, -0.6, 0.8], atol=1e-9)
    assert placed().axis is None
    assert placed().axis_bound_deg is None


def test_a_hole_is_missed_by_so_much() -> None:
    # Bone coordinates (13, 4, 7): 3 and 4 beside the line, 7 into the bone; 10 deg aslant.
    slanted = (np.sin(np.radians(10.0)), 0.0, np.cos(np.radians(10.0)))
    offset = placed((-14.0, -7.0, 17.0), slanted).hole_offset("lateral peg", HOLE)
    assert offset.name == "lateral peg"
    assert offset.off_mm == pytest.approx(5.0)
    assert offset.depth_mm == pytest.approx(7.0)
    assert offset.angle_deg == pytest.approx(10.0)
    assert offset.bound_deg == pytest.approx(0.0, abs=0.001)


def test_before_the_bone_the_depth_is_negative_and_backwards_is_half_a_turn() -> None:
    offset = placed((-14.0, -7.0, 5.0), (0.0, 0.0, -1.0)).hole_offset("peg", HOLE)
    assert offset.depth_mm == pytest.approx(-5.0)
    assert offset.angle_deg == pytest.approx(180.0)


def test_without_an_axis_no_angle_is_told() -> None:
    offset = placed((-14.0, -7.0, 17.0)).hole_offset("peg", HOLE)
    assert (offset.angle_deg, offset.bound_deg) == (None, None)
    assert offset.off_mm == pytest.approx(5.0)


def test_a_seen_size_shifts_the_tip_and_turns_the_axis() -> None:
    """5 % at a tip that lies (13, 15, -43) mm from the model's middle, about which it grows."""
    step = np.array([0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 1.0])
    sized = SizedPose(step, np.eye(7), np.zeros(3), lever_mm=20.0)
    tool = tool_of(tip_mm=(3.0, -5.0, 17.0), tip_sigma_mm=1e-6, axis=(0.0, 0.0, 1.0))
    found = place_on_bone(
        seen_at(tool, PLATE, TINY),
        "femur",
        replace(estimate_of(TINY), sized=sized),
        np.array([0.0, 0.0, 50.0]),
    )
    shift_mm = 0.05 * np.array([13.0, 15.0, -43.0]) + np.cross(
        [0.01, 0.0, 0.0], (13.0, 15.0, -43.0)
    )
    assert np.trace(found.covariance_mm2) == pytest.approx(shift_mm @ shift_mm, rel=1e-6)
    assert found.axis_bound_deg == pytest.approx(np.degrees(0.01) * rayleigh.ppf(0.95), rel=1e-2)


def test_the_bound_grows_with_what_is_not_known_of_the_bone() -> None:
    shifted = placed(by_bone=np.diag([0.01] * 3 + [1e-12] * 3))
    assert shifted.bound_mm == pytest.approx(0.1 * np.sqrt(chi2.ppf(0.95, 3)), rel=1e-3)
    both = placed(
        by_bone=np.diag([0.0009] * 3 + [1e-12] * 3), by_plate=np.diag([0.0016] * 3 + [1e-12] * 3)
    )
    assert both.bound_mm == pytest.approx(0.05 * np.sqrt(chi2.ppf(0.95, 3)), rel=1e-2)


def test_a_turn_of_the_bone_counts_by_the_tips_distance_from_its_middle() -> None:
    # The tip lies on the bone's z, 43 mm from the middle: a turn about x moves it along y.
    turned = placed((-10.0, -20.0, 17.0), by_bone=np.diag([1e-12] * 3 + [1e-4, 1e-12, 1e-12]))
    np.testing.assert_allclose(turned.tip_mm, [0.0, 0.0, 7.0], atol=1e-9)
    # About the camera's x; the camera's y is the bone's x.
    np.testing.assert_allclose(turned.covariance_mm2, np.diag([0.43**2, 0.0, 0.0]), atol=1e-6)


def test_what_is_not_known_is_told_in_the_bones_directions() -> None:
    covariance = np.diag([0.04, 0.0001, 0.0001] + [1e-12] * 3)
    for one in (placed(by_bone=covariance), placed(by_plate=covariance)):
        # Along the camera's x, which is the bone's -y.
        np.testing.assert_allclose(np.diag(one.covariance_mm2), [0.0001, 0.04, 0.0001], atol=1e-6)


def test_the_axis_is_as_uncertain_as_tool_and_bone_together() -> None:
    turned = placed(
        axis=(0.0, 0.0, 1.0), axis_sigma_rad=0.003, by_bone=np.diag([1e-12] * 3 + [16e-6] * 3)
    )
    expected = np.degrees(0.005 * rayleigh.ppf(0.95))
    assert turned.axis_bound_deg == pytest.approx(expected, rel=1e-3)


def test_the_nearest_of_some_places_is_told_by_name() -> None:
    tool = placed()
    places = {"far": np.zeros(3), "near": np.array([15.0, -13.0, 10.0])}
    nearest = tool.nearest(places)
    assert nearest is not None
    assert nearest[0] == "near"
    assert nearest[1] == pytest.approx(3.0)
    assert tool.nearest({}) is None
