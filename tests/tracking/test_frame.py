"""What a fit on the model leaves beyond the noise."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.tracking.frame import NOISE_VARIANCE_RATIO, TOLERATED_VARIANCE_RATIO, Fit
from navapp.tracking.surface_meter import Measurement
from navapp.values import PoseEstimate, SurfaceCloud
from tests.tracking.meters import NO_MAP

CLAIMED_MM, KERNEL_MM = 0.2, 0.24
NO_CLOUD = SurfaceCloud(
    np.empty((0, 3)), np.empty(0), np.empty((0, 2), np.int32), np.empty(0, np.uint8)
)


def fit_of(ratio: float) -> Fit:
    """Gaussian residuals of so much of what they claim, seen through the follower's kernel."""
    noise = ratio * CLAIMED_MM * np.random.default_rng(1).standard_normal(200_000)
    kernel = np.exp(-0.5 * (noise / KERNEL_MM) ** 2)
    rms_mm = float(np.sqrt((kernel * noise**2).sum() / kernel.sum()))
    pose = RigidTransform.identity("left_rect", "femur")
    estimate = PoseEstimate(pose, np.eye(6), 2000, 0.9, rms_mm, CLAIMED_MM, 9, True)
    return Fit(estimate, Measurement(NO_MAP, lambda: NO_CLOUD, 1.0, 11.0))


@pytest.mark.parametrize("ratio", [0.3, 0.55, 0.8, 1.0])
def test_the_kernel_hides_nothing_of_the_residuals(ratio: float) -> None:
    assert fit_of(ratio).variance_ratio ** 0.5 == pytest.approx(ratio, rel=0.02)


def test_noise_counts_as_right_poses_show_it() -> None:
    assert pytest.approx(0.57**2) == NOISE_VARIANCE_RATIO
    assert pytest.approx(0.65**2) == TOLERATED_VARIANCE_RATIO


@pytest.mark.parametrize("noise_variance_ratio", [0.57**2, 1.0])
@pytest.mark.parametrize("ratio", [0.3, 0.55])
def test_noise_alone_changes_nothing(ratio: float, noise_variance_ratio: float) -> None:
    """Few residuals may show less by chance: that promises nothing."""
    quiet = fit_of(ratio)
    told = quiet.with_correlated_residuals(noise_variance_ratio)
    assert told.estimate.covariance == pytest.approx(quiet.estimate.covariance)
    assert told.estimate.reasons == ()


@pytest.mark.parametrize("noise_variance_ratio", [0.57**2, 1.0])
def test_what_goes_together_over_40_px_counts_so_often(noise_variance_ratio: float) -> None:
    """A window of 11 px says it (40 / 11)^2 times, and each time the same."""
    loose = fit_of(0.8)
    covariance = noise_variance_ratio * loose.estimate.covariance
    made_with = replace(loose, estimate=replace(loose.estimate, covariance=covariance))
    variance = noise_variance_ratio + (0.8**2 - 0.65**2) * (40.0 / 11.0) ** 2
    told = made_with.with_correlated_residuals(noise_variance_ratio)
    assert np.trace(told.estimate.covariance) == pytest.approx(6.0 * variance, rel=0.05)
    assert (told.measured, told.pose) == (loose.measured, loose.pose)


def test_residuals_that_the_kernel_steps_off_show_the_most() -> None:
    saturated = fit_of(0.9)
    saturated = replace(saturated, estimate=replace(saturated.estimate, rms_mm=1.0))
    limit = 2.0 * TOLERATED_VARIANCE_RATIO
    assert saturated.variance_ratio > limit
    assert fit_of(0.95).variance_ratio > limit > fit_of(0.8).variance_ratio
