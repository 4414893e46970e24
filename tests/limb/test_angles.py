"""Angles of Grood and Suntay: signs by words on both sides, and bounds that hold."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.limb.angles import measure_angles
from navapp.limb.axes import find_limb_axes, find_missing
from navapp.values import ANKLE_CENTRE, HIP_CENTRE, SizedPose
from tests.limb.knees import camera_from_femur, estimate, femur_from_tibia, landmarks


def measure(relative, side, femur_covariance=None, tibia_covariance=None):
    femur = camera_from_femur()
    axes = find_limb_axes(landmarks(side))
    return measure_angles(
        axes, estimate(femur, femur_covariance), estimate(femur @ relative, tibia_covariance), side
    )


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_bent_knee_has_its_flexion_alone(side) -> None:
    angles = measure(femur_from_tibia(73.0), side)
    assert angles.flexion_deg == pytest.approx(73.0)
    assert (angles.varus_deg, angles.internal_rotation_deg) == pytest.approx((0.0, 0.0))


@pytest.mark.parametrize(("side", "medial"), [("right", 1.0), ("left", -1.0)])
def test_varus_moves_the_ankle_towards_the_other_leg_and_internal_rotation_the_toes(
    side, medial
) -> None:
    relative = femur_from_tibia(0.0, -4.0 * medial, 6.0 * medial)
    angles = measure(relative, side)
    assert angles.varus_deg == pytest.approx(4.0)
    assert angles.internal_rotation_deg == pytest.approx(6.0)
    ankle, toes = relative.rotate([(0.0, 0.0, -1.0), (0.0, -1.0, 0.0)])
    assert np.sign(ankle[0]) == medial
    assert np.sign(toes[0]) == medial


def test_all_three_at_once_are_told_apart_at_any_flexion() -> None:
    for flexion_deg in (-5.0, 30.0, 90.0, 125.0):
        angles = measure(femur_from_tibia(flexion_deg, -7.0, 11.0), "right")
        found = (angles.flexion_deg, angles.varus_deg, angles.internal_rotation_deg)
        assert found == pytest.approx((flexion_deg, 7.0, 11.0))


def test_bounds_count_both_covariances() -> None:
    covariance = np.zeros((6, 6))
    covariance[3:, 3:] = np.radians(0.1) ** 2 * np.eye(3)
    one = measure(femur_from_tibia(60.0), "right", covariance)
    both = measure(femur_from_tibia(60.0), "right", covariance, covariance)
    assert one.flexion_bound_deg == pytest.approx(1.96 * 0.1)
    assert both.varus_bound_deg == pytest.approx(1.96 * 0.1 * 2**0.5)


def test_bounds_count_the_turn_by_a_seen_size() -> None:
    relative = femur_from_tibia(60.0)
    step = np.array([0.0, 0.0, 0.0, 0.002, 0.001, -0.003, 0.5])
    sized = SizedPose(step, np.eye(7), np.zeros(3), lever_mm=20.0)
    femur, tibia = estimate(camera_from_femur()), estimate(camera_from_femur() @ relative)
    axes = find_limb_axes(landmarks("right"))
    grown = measure_angles(axes, replace(femur, sized=sized), tibia, "right")
    turned = measure(relative, "right", np.outer(step[:6], step[:6]))
    for name in ("flexion", "varus", "internal_rotation"):
        bound_deg = getattr(grown, f"{name}_bound_deg")
        assert bound_deg == pytest.approx(getattr(turned, f"{name}_bound_deg"))
        assert bound_deg > 0.01


def test_bounds_hold_for_drawn_poses() -> None:
    rng = np.random.default_rng(3)
    half = 0.003 * rng.standard_normal((2, 3, 3))
    covariances = np.zeros((2, 6, 6))
    covariances[:, 3:, 3:] = half @ half.transpose(0, 2, 1)
    relative, femur = femur_from_tibia(80.0, -5.0, 9.0), camera_from_femur()
    axes, names = find_limb_axes(landmarks()), ("flexion", "varus", "internal_rotation")
    true = measure_angles(axes, estimate(femur), estimate(femur @ relative), "right")
    held = []
    for _ in range(400):
        poses = [
            pose.move(rng.multivariate_normal(np.zeros(6), one), np.zeros(3))
            for pose, one in zip((femur, femur @ relative), covariances, strict=True)
        ]
        found = measure_angles(
            axes, *(estimate(p, c) for p, c in zip(poses, covariances, strict=True)), "right"
        )
        held.append([
            abs(getattr(found, f"{name}_deg") - getattr(true, f"{name}_deg"))
            <= getattr(found, f"{name}_bound_deg")
            for name in names
        ])  # fmt: skip
    assert np.mean(held, axis=0) == pytest.approx(0.95, abs=0.035)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (HIP_CENTRE, "no hip centre in the plan"),
        (ANKLE_CENTRE, "no ankle centre in the plan"),
        ("femur/knee_centre", "no knee centre in the plan"),
        ("tibia/medial_plateau", "no medial plateau in the plan"),
    ],
)
def test_what_is_missing_is_said(name, words) -> None:
    known = landmarks()
    assert find_missing(known) is None
    del known[name]
    assert find_missing(known) == words
    assert find_limb_axes(known) is None
