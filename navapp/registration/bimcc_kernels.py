"""Compiled loops of the production BiMCC-ICP: pairs, weights, step, width of the kernel, stop."""

from typing import NamedTuple

import numpy as np
from numba import njit

from navapp.registration.lookup_kernels import ModelArrays, VoxelGrid
from navapp.registration.pairing_kernels import (
    Pairs,
    Pose,
    SceneArrays,
    measure_pairs,
    pair_backward,
    pair_forward,
)
from navapp.registration.step_kernels import make_step, noise_under_kernel_mm2, weigh

# All chosen. While the pose has moved the points by less than this, their pairs stay.
_PAIRS_HOLD_MM = 0.2
# A visible model point must look at the camera at least so much (cosine).
_FACING = 0.2
_FEWEST_PAIRS = 6
# Pairs that flip to and fro never let the last step become small: so many steps in a row below so
# many times the limit will do.
_SMALL_STEPS, NEARLY = 5, 5.0
# The pose has followed a kernel when its step is below this angle and this fraction of the kernel.
_FOLLOWED_RAD, _FOLLOWED_FRACTION = 0.02, 0.15
# Noise stays when the kernel is halved; what a wrong pose leaves shrinks by nearly as much.
_NOISE_STAYS = 0.75
# A kernel that changes by less than this fraction is as wide as the noise.
_SAME_WIDTH = 0.02


class BimccSettings(NamedTuple):
    """How the estimator works; all chosen."""

    widest_mm: float = 12.0  # the kernel at most, and the longest backward pair
    narrowest_mm: float = 0.3  # the kernel at least
    # the kernel's width in standard deviations of the noise; on pure noise a width k has (1 + 2 /
    # k^2)^1.5 / (1 + 1 / k^2)^3 of the efficiency of least squares: 97 % at 2.5.
    n_sigmas: float = 2.5
    largest_noise_mm: float = 1.0  # points noisier than this are not expected
    backward_weight: float = 1.5  # what all backward pairs weigh beside all forward pairs
    # what a pair's whole distance weighs beside its plane's in the coarse loop.
    point_weight: float = 0.1
    model_points: int = 1500  # so many model points ask backward, about
    max_iterations: int = 60  # of each loop
    # stop_mm, stop_rad: a smaller step ends the fit.
    stop_mm: float = 2e-3
    stop_rad: float = 2e-5

    @property
    def widest_at_rest_mm(self) -> float:
        """The kernel over the largest noise: one that stays as wide has met something else."""
        return self.n_sigmas * self.largest_noise_mm


class LoopState(NamedTuple):
    """How a loop ended."""

    iterations: int  # so many steps were made
    # the kernel is as narrow as the noise (coarse), the pose stands still (fine).
    has_finished: bool
    sigma_mm: float  # width of the kernel; 0 when too few points paired
    n_pairs: int  # in the last step


@njit(cache=True, nogil=True)
def choose_first_sigma_mm(
    scene: SceneArrays, model: ModelArrays, pose: Pose, pairs: Pairs, settings: BimccSettings
) -> float:
    """Width to begin with: 1.5 times the median distance of thinned pairs; 0 with too few."""
    n = pair_forward(scene, model, pose, scene.every, pairs)
    if n < _FEWEST_PAIRS:
        return 0.0
    measure_pairs(scene, model, pose, pairs, n)
    residual, excess = pairs.residual[:n], pairs.excess[:n]
    first_mm: float = 1.5 * np.median(np.sqrt(residual * residual + excess * excess))
    return min(max(first_mm, settings.narrowest_mm), settings.widest_mm)


@njit(cache=True, nogil=True)
def follow_noise_mm(noise_mm: float, sigma_mm: float, settings: BimccSettings) -> float:
    """Width of the kernel for a noise, within its bounds; as it is when that is nearly the same."""
    wanted_mm = max(settings.n_sigmas * noise_mm, settings.narrowest_mm)
    wanted_mm = min(wanted_mm, settings.n_sigmas * settings.largest_noise_mm)
    return sigma_mm if abs(wanted_mm - sigma_mm) < _SAME_WIDTH * sigma_mm else wanted_mm


@njit(cache=True, nogil=True)
def run_coarse_loop(
    scene: SceneArrays, grid: VoxelGrid, model: ModelArrays, pose: Pose, pairs: Pairs,
    sigma_mm: float, settings: BimccSettings,
) -> LoopState:  # fmt: skip
    """Thinned points pair both ways under a kernel that narrows; the pose in place.

    The kernel is halved whenever the pose has followed, until it is as narrow as the noise: noise
    stays the same when the kernel narrows, what a wrong pose leaves shrinks with it.
    """
    model_every = max(1, model.points.shape[0] // settings.model_points)
    widest_noise_mm = settings.n_sigmas * settings.largest_noise_mm
    last_noise_mm = np.inf
    for iteration in range(1, settings.max_iterations + 1):
        n_forward = pair_forward(scene, model, pose, scene.every, pairs)
        if n_forward < _FEWEST_PAIRS:
            return LoopState(iteration, False, 0.0, 0)
        radius_mm = min(3.0 * sigma_mm, settings.widest_mm)
        n, _ = pair_backward(
            scene, grid, model, pose, model_every, radius_mm, _FACING, pairs, n_forward
        )
        measure_pairs(scene, model, pose, pairs, n)
        # While far, distances say how far off the pose is, not how exact a part of the bone is:
        # weights by noise alone let the exact parts pull everything to themselves.
        off_mm2 = (sigma_mm / settings.n_sigmas) ** 2
        sums = weigh(pairs, n, sigma_mm, settings.n_sigmas, off_mm2)
        if sums.kernels < _FEWEST_PAIRS:
            return LoopState(iteration, False, 0.0, 0)
        pairs.weight[n_forward:n] *= settings.backward_weight * n_forward / max(n - n_forward, 1)
        turn_rad, shift_mm, _ = make_step(pairs, n, model, settings.point_weight, pose)
        if turn_rad > _FOLLOWED_RAD or shift_mm > _FOLLOWED_FRACTION * sigma_mm:
            continue
        if sigma_mm <= settings.narrowest_mm:
            return LoopState(iteration, True, sigma_mm, n)
        if not scene.knows_noise and sigma_mm <= widest_noise_mm:
            noise_mm = np.sqrt(noise_under_kernel_mm2(sums.squares_mm2, sums.kernels, sigma_mm))
            if settings.n_sigmas * noise_mm >= sigma_mm and noise_mm > _NOISE_STAYS * last_noise_mm:
                return LoopState(iteration, True, settings.n_sigmas * noise_mm, n)
            last_noise_mm = noise_mm
        sigma_mm = max(0.5 * sigma_mm, settings.narrowest_mm)
    return LoopState(settings.max_iterations, False, sigma_mm, n)


@njit(cache=True, nogil=True)
def run_fine_loop(
    scene: SceneArrays, model: ModelArrays, pose: Pose, pairs: Pairs, sigma_mm: float,
    settings: BimccSettings,
) -> LoopState:  # fmt: skip
    """All points pair forward under a kernel as narrow as the noise; the pose in place.

    Forward only: the nearest of noisy points is a biased choice.
    """
    moved_mm, n_small, n = np.inf, 0, 0
    for iteration in range(1, settings.max_iterations + 1):
        if moved_mm > _PAIRS_HOLD_MM:
            n = pair_forward(scene, model, pose, 1, pairs)
            moved_mm = 0.0
        measure_pairs(scene, model, pose, pairs, n)
        sums = weigh(pairs, n, sigma_mm, settings.n_sigmas, 0.0)
        if sums.kernels < _FEWEST_PAIRS:
            return LoopState(iteration, False, 0.0, 0)
        turn_rad, shift_mm, lever_mm = make_step(pairs, n, model, 0.0, pose)
        moved_mm += shift_mm + turn_rad * lever_mm
        last_mm = sigma_mm
        if not scene.knows_noise:
            noise_mm = np.sqrt(noise_under_kernel_mm2(sums.squares_mm2, sums.kernels, sigma_mm))
            sigma_mm = follow_noise_mm(noise_mm, sigma_mm, settings)
        is_small = turn_rad < settings.stop_rad and shift_mm < settings.stop_mm
        is_nearly_small = (
            turn_rad < NEARLY * settings.stop_rad and shift_mm < NEARLY * settings.stop_mm
        )
        n_small = n_small + 1 if is_nearly_small else 0
        if sigma_mm == last_mm and (is_small or n_small >= _SMALL_STEPS):
            return LoopState(iteration, True, sigma_mm, n)
    return LoopState(settings.max_iterations, False, sigma_mm, n)
