"""Tip and axis of a seen tool, and how certain they are."""

import numpy as np
import pytest
from scipy.stats import chi2, rayleigh

from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.tools.tool import angle_bound_rad, bound_of
from tests.tools.seen_tools import TIP_MM, seen_at, tool_of

POSE = RigidTransform.from_parts(
    "left", "plate", rotation_from_vector((0.0, 0.0, 0.5 * np.pi)), (1.0, 2.0, 400.0)
)


def test_tip_and_axis_go_with_the_plate() -> None:
    seen = seen_at(tool_of(tip_mm=(10.0, 20.0, 30.0), axis=(0.0, 0.6, 0.8)), POSE)
    np.testing.assert_allclose(seen.tip_mm, [-19.0, 12.0, 430.0], atol=1e-12)
    assert seen.axis is not None
    np.testing.assert_allclose(seen.axis, [-0.6, 0.0, 0.8], atol=1e-12)
    assert seen_at(tool_of(), POSE).axis is None


def test_the_tips_covariance_is_that_of_its_scatter() -> None:
    rng = np.random.default_rng(2)
    root = rng.normal(0.0, 1.0, (6, 6)) * np.array([0.02] * 3 + [3e-4] * 3)[:, None]
    tool = tool_of(tip_sigma_mm=0.03)
    seen = seen_at(tool, POSE, root @ root.T)
    tips = []
    for twist, off in zip(
        rng.normal(0.0, 1.0, (4000, 6)) @ root.T, rng.normal(0.0, 0.03, (4000, 3)), strict=True
    ):
        moved = POSE.move(twist, POSE.translation_mm)
        tips.append(moved.apply(TIP_MM + off))
    scatter, told = np.cov(np.array(tips).T), seen.tip_covariance_mm2
    np.testing.assert_allclose(scatter, told, atol=0.07 * np.trace(told))
    assert seen.tip_bound_mm == pytest.approx(bound_of(told))


def test_bounds_are_those_of_the_distributions() -> None:
    assert bound_of(np.diag([0.01, 0.25, 0.04])) == pytest.approx(
        0.5 * np.sqrt(chi2.ppf(0.95, 3)), rel=1e-3
    )
    assert angle_bound_rad(0.04) == pytest.approx(0.2 * rayleigh.ppf(0.95), rel=1e-3)


def test_the_axis_is_as_uncertain_as_pose_and_calibration_together() -> None:
    covariance = np.diag([1e-6] * 3 + [1e-8, 9e-6, 4e-6])
    tool = tool_of(axis=(0.0, 0.0, 1.0), axis_sigma_rad=0.004)
    expected = 0.005 * rayleigh.ppf(0.95)
    assert seen_at(tool, POSE, covariance).axis_bound_rad == pytest.approx(expected, rel=1e-3)
