from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.tracking.correlated_residuals import (
    is_misfit,
    noise_ratio2,
    shown_ratio2,
    with_correlated_residuals,
)
from navapp.values import PoseEstimate, Reason

CLAIMED_MM, KERNEL_MM = 0.2, 0.24


def estimate(ratio: float) -> PoseEstimate:
    """Gaussian residuals of so much of what they claim, seen through the follower's kernel."""
    noise = ratio * CLAIMED_MM * np.random.default_rng(1).standard_normal(200_000)
    kernel = np.exp(-0.5 * (noise / KERNEL_MM) ** 2)
    rms_mm = float(np.sqrt((kernel * noise**2).sum() / kernel.sum()))
    pose = RigidTransform.identity("left_rect", "femur")
    return PoseEstimate(pose, np.eye(6), 2000, 0.9, rms_mm, CLAIMED_MM, 9, True)


@pytest.mark.parametrize("ratio", [0.3, 0.55, 0.8, 1.0])
def test_the_kernel_hides_nothing_of_the_residuals(ratio: float) -> None:
    assert shown_ratio2(estimate(ratio)) ** 0.5 == pytest.approx(ratio, rel=0.02)


def test_noise_counts_as_right_poses_show_it_where_the_bone_lies_open() -> None:
    assert noise_ratio2(lies_open=True) == pytest.approx(0.65**2)
    assert noise_ratio2(lies_open=False) == 1.0


@pytest.mark.parametrize("noise2", [0.65**2, 1.0])
@pytest.mark.parametrize("ratio", [0.3, 0.55])
def test_noise_alone_changes_nothing(ratio: float, noise2: float) -> None:
    """Few residuals may show less by chance: that promises nothing."""
    quiet = estimate(ratio)
    told = with_correlated_residuals(quiet, noise2)
    assert told.covariance == pytest.approx(quiet.covariance)
    assert told.reasons == ()


@pytest.mark.parametrize("noise2", [0.65**2, 1.0])
def test_what_goes_together_over_40_px_counts_so_often(noise2: float) -> None:
    """A window of 11 px says it (40 / 11)^2 times, and each time the same."""
    loose = estimate(0.8)
    made_with = replace(loose, covariance=noise2 * loose.covariance)
    variance = noise2 + (0.8**2 - 0.65**2) * (40.0 / 11.0) ** 2
    told = with_correlated_residuals(made_with, noise2)
    assert np.trace(told.covariance) == pytest.approx(6.0 * variance, rel=0.05)
    assert not is_misfit(loose)


def test_more_in_common_than_noise_is_a_misfit() -> None:
    doubted = with_correlated_residuals(estimate(0.95), 1.0)
    assert Reason.SURFACE_MISFIT in doubted.reasons
    saturated = replace(estimate(0.9), rms_mm=1.0)
    assert is_misfit(saturated)
