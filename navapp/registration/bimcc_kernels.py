"""Compiled loop of the production BiMCC-ICP: pairs, weights, step, width of the kernel, stop."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.registration.lookup_kernels import ModelArrays, SceneGrid
from navapp.registration.pairing_kernels import (
    Pairs,
    SceneArrays,
    measure_pairs,
    pair_backward,
    pair_forward,
)
from navapp.registration.step_kernels import (
    add_point_system,
    apply_twist,
    noise_under_kernel_mm2,
    plane_step,
    plane_system,
    weigh,
    weighted_centre,
)

# While the pose has moved the points by less than this since they were paired, the pairs stand.
_PAIRS_HOLD_MM = 0.2
# A visible model point must look at the camera at least so much (cosine).
_FACING = 0.2
_FEWEST_PAIRS = 6
# Pairs that flip to and fro never let the last step become small: so many steps in a row that are
# nearly small enough will do.
_RESTS, _NEARLY = 5, 5.0
# The pose has followed a kernel when its step is below this angle and this share of the kernel.
_FOLLOWED_RAD, _FOLLOWED_SHARE = 0.02, 0.15
# Noise stays when the kernel is halved; what a wrong pose leaves shrinks by nearly as much.
_NOISE_STAYS = 0.75


class LoopSettings(NamedTuple):
    """Settings of the loops; `navapp.registration.bimcc.BimccSettings` says what they mean."""

    widest_mm: float
    narrowest_mm: float
    n_sigmas: float
    widest_at_rest_mm: float
    knows_noise: bool
    backward_weight: float
    point_weight: float
    scene_every: int
    model_every: int
    max_iterations: int
    settled_rad: float
    settled_mm: float


class LoopState(NamedTuple):
    """Where a loop stands.

    Attributes:
        iterations: so many steps were made.
        has_finished: it met its end: for the loop from far the kernel is narrow, for the last one
            the pose has settled.
        sigma_mm: width of the kernel; 0 when too few points paired.
        n_pairs: the last so many pairs.
        objective: their J.
    """

    iterations: int
    has_finished: bool
    sigma_mm: float
    n_pairs: int
    objective: float


@njit(cache=True, nogil=True)
def first_sigma_mm(
    scene: SceneArrays,
    model: ModelArrays,
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    pairs: Pairs,
    settings: LoopSettings,
) -> float:
    """Width to begin with: 1.5 times the median distance of thinned pairs; 0 with too few."""
    camera = rotation @ scene.camera + translation
    n = pair_forward(scene, model, rotation, translation, camera, settings.scene_every, pairs)
    if n < _FEWEST_PAIRS:
        return 0.0
    measure_pairs(scene, model, rotation, translation, camera, pairs, 0, n)
    distance = np.empty(n)
    for i in range(n):
        distance[i] = np.sqrt(pairs.residual[i] ** 2 + pairs.excess[i] ** 2)
    first_mm: float = 1.5 * np.median(distance)
    return min(max(first_mm, settings.narrowest_mm), settings.widest_mm)


@njit(cache=True, nogil=True)
def loop_from_far(
    scene: SceneArrays,
    grid: SceneGrid,
    model: ModelArrays,
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    pairs: Pairs,
    sigma_mm: float,
    settings: LoopSettings,
) -> LoopState:
    """Thinned points pair both ways under a kernel that narrows; the pose in place.

    The kernel is halved whenever the pose has followed, until it is as narrow as the noise: noise
    stays the same when the kernel narrows, what a wrong pose leaves shrinks with it.
    """
    H, g, twist = np.empty((6, 6)), np.empty(6), np.empty(6)
    camera, centre = np.empty(3), np.empty(3)
    objective, last_noise_mm, n = 0.0, np.inf, 0
    for iteration in range(1, settings.max_iterations + 1):
        camera[:] = rotation @ scene.camera + translation
        n_forward = pair_forward(
            scene, model, rotation, translation, camera, settings.scene_every, pairs
        )
        if n_forward < _FEWEST_PAIRS:
            return LoopState(iteration, False, 0.0, 0, 0.0)
        n = pair_backward(
            scene, grid, model, rotation, translation, camera, settings.model_every,
            min(3.0 * sigma_mm, settings.widest_mm), _FACING, pairs, n_forward,
        )  # fmt: skip
        measure_pairs(scene, model, rotation, translation, camera, pairs, 0, n)
        # From far, distances say how far off the pose is, not how exact a part of the bone is:
        # weights by noise alone let the exact parts pull everything to themselves.
        off_mm2 = (sigma_mm / settings.n_sigmas) ** 2
        sums = weigh(pairs, n, sigma_mm, settings.n_sigmas, off_mm2)
        if sums.kernels < _FEWEST_PAIRS:
            return LoopState(iteration, False, 0.0, 0, 0.0)
        objective = sums.kernels / n
        balance = settings.backward_weight * n_forward / max(n - n_forward, 1)
        for k in range(n_forward, n):
            pairs.weight[k] *= balance
        lever_mm = weighted_centre(pairs, n, centre)
        plane_system(pairs, n, centre, lever_mm, H, g)
        add_point_system(pairs, n, model, settings.point_weight, centre, lever_mm, H, g)
        plane_step(H, g, lever_mm, twist)
        apply_twist(twist, centre, rotation, translation)
        turn_rad, shift_mm = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
        if turn_rad > _FOLLOWED_RAD or shift_mm > _FOLLOWED_SHARE * sigma_mm:
            continue
        if sigma_mm <= settings.narrowest_mm:
            return LoopState(iteration, True, sigma_mm, n, objective)
        if not settings.knows_noise and sigma_mm <= settings.widest_at_rest_mm:
            noise_mm = np.sqrt(noise_under_kernel_mm2(sums.squares_mm2, sums.kernels, sigma_mm))
            if settings.n_sigmas * noise_mm >= sigma_mm and noise_mm > _NOISE_STAYS * last_noise_mm:
                return LoopState(iteration, True, settings.n_sigmas * noise_mm, n, objective)
            last_noise_mm = noise_mm
        sigma_mm = max(0.5 * sigma_mm, settings.narrowest_mm)
    return LoopState(settings.max_iterations, False, sigma_mm, n, objective)


@njit(cache=True, nogil=True)
def loop_to_rest(
    scene: SceneArrays,
    model: ModelArrays,
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    pairs: Pairs,
    sigma_mm: float,
    settings: LoopSettings,
) -> LoopState:
    """All points pair forward under a kernel as narrow as the noise; the pose in place.

    Forward only: the nearest of noisy points is a biased choice.
    """
    H, g, twist = np.empty((6, 6)), np.empty(6), np.empty(6)
    camera, centre = np.empty(3), np.empty(3)
    moved_mm, objective, n_rests, n = np.inf, 0.0, 0, 0
    for iteration in range(1, settings.max_iterations + 1):
        camera[:] = rotation @ scene.camera + translation
        if moved_mm > _PAIRS_HOLD_MM:
            n = pair_forward(scene, model, rotation, translation, camera, 1, pairs)
            moved_mm = 0.0
        measure_pairs(scene, model, rotation, translation, camera, pairs, 0, n)
        sums = weigh(pairs, n, sigma_mm, settings.n_sigmas, 0.0)
        if sums.kernels < _FEWEST_PAIRS:
            return LoopState(iteration, False, 0.0, 0, 0.0)
        objective = sums.kernels / n
        lever_mm = weighted_centre(pairs, n, centre)
        plane_system(pairs, n, centre, lever_mm, H, g)
        plane_step(H, g, lever_mm, twist)
        apply_twist(twist, centre, rotation, translation)
        turn_rad, shift_mm = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
        moved_mm += shift_mm + turn_rad * lever_mm
        is_steady = True
        if not settings.knows_noise:
            noise_mm = np.sqrt(noise_under_kernel_mm2(sums.squares_mm2, sums.kernels, sigma_mm))
            wanted_mm = max(settings.n_sigmas * noise_mm, settings.narrowest_mm)
            wanted_mm = min(wanted_mm, settings.widest_at_rest_mm)
            is_steady = abs(wanted_mm - sigma_mm) < 0.02 * sigma_mm
            sigma_mm = sigma_mm if is_steady else wanted_mm
        if is_steady and turn_rad < settings.settled_rad and shift_mm < settings.settled_mm:
            return LoopState(iteration, True, sigma_mm, n, objective)
        is_resting = (
            turn_rad < _NEARLY * settings.settled_rad and shift_mm < _NEARLY * settings.settled_mm
        )
        n_rests = n_rests + 1 if is_resting else 0
        if is_steady and n_rests >= _RESTS:
            return LoopState(iteration, True, sigma_mm, n, objective)
    return LoopState(settings.max_iterations, False, sigma_mm, n, objective)
