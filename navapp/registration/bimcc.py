"""Production BiMCC-ICP: bidirectional maximum correntropy against what one camera can see.

A coarse loop pairs thinned points both ways while the kernel narrows; a fine loop pairs all points
forward under a kernel as narrow as the noise (equations in docs/how/registration.md).
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.bimcc_kernels import (
    NEARLY,
    BimccSettings,
    LoopState,
    choose_first_sigma_mm,
    follow_noise_mm,
    run_coarse_loop,
    run_fine_loop,
)
from navapp.registration.cartilage_fit import KernelWidth, ThicknessField, ThicknessFit
from navapp.registration.information import Information, compute_information
from navapp.registration.model import RegistrationModel
from navapp.registration.pairing_kernels import Pose, make_pairs, measure_pairs, pair_forward
from navapp.registration.scene import NO_GRID, Scene
from navapp.registration.step_kernels import noise_under_kernel_mm2, weigh
from navapp.values import PoseEstimate, Reason

DEFAULT = BimccSettings()
# All chosen.
MIN_POINTS = 60
# Pairs that are longer than so many widths of the kernel take no part in the figures.
_REACH_SIGMAS, _NOISE_ROUNDS = 4.0, 20
# A first kernel of this width means a start some millimetres off.
_NEAR_SIGMA_MM = 5.0
# Of a fit of pose and thickness: rounds under a wide kernel, and all of them.
_WIDE_ROUNDS, _MOST_THICKNESS_ROUNDS = 2, 20


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A pose and what stands behind it."""

    estimate: PoseEstimate  # the pose with its covariance
    # what the pairs fix, and what they leave free; None when too few pair.
    information: Information | None
    sigma_mm: float  # width of the kernel at the end
    # points_mm, residual_mm: (M, 3) in bone coordinates and (M,), of the pairs that fit.
    points_mm: FloatArray
    residual_mm: FloatArray

    def with_reason(self, reason: Reason) -> "Solution":
        """The same solution with one more reason against its pose."""
        return replace(self, estimate=self.estimate.with_reason(reason))


def fit_bimcc(
    scene: Scene, model: RegistrationModel, start: RigidTransform, settings: BimccSettings = DEFAULT
) -> PoseEstimate:
    """Register a model to a scene from a start (`scene_from_bone`).

    When too few points pair, the estimate's reasons say so.

    Source: the paper, proposed equations 4 to 9 (corrected), Algorithm 2; Chen and Medioni 1992.
    """
    return solve_bimcc(scene, model, start, settings).estimate


def solve_bimcc(
    scene: Scene, model: RegistrationModel, start: RigidTransform, settings: BimccSettings = DEFAULT
) -> Solution:
    """As `fit_bimcc`, with all that stands behind the pose."""
    fit = _Fit(scene, model, start, settings)
    if len(scene) < MIN_POINTS:
        return fit.too_few_points(len(scene))
    iterations, is_converged = fit.run()
    tells_thickness = scene.tells_shape and scene.knows_noise and is_converged
    if tells_thickness and model.thickness is not None:
        n_rounds, is_converged = fit.fit_thickness(model.thickness)
        iterations += n_rounds
    return fit.solution(iterations, is_converged=is_converged)


def fit_pose(
    scene: Scene, model: RegistrationModel, start: RigidTransform, settings: BimccSettings
) -> RigidTransform | None:
    """The pose of `fit_bimcc` alone, which is sooner found; None when too few points pair.

    An error of the cartilage's thickness stays in it.
    """
    fit = _Fit(scene, model, start, settings)
    if len(scene) < MIN_POINTS:
        return None
    fit.run()
    return fit.pose if np.count_nonzero(fit.find_near().is_near) >= MIN_POINTS else None


def fit_coarsely(
    scene: Scene, model: RegistrationModel, start: RigidTransform, settings: BimccSettings
) -> RigidTransform | None:
    """The pose after the coarse loop alone; None when it does not end."""
    fit = _Fit(scene, model, start, settings)
    return fit.pose if fit.run_coarse().has_finished else None


def solution_at(
    scene: Scene,
    model: RegistrationModel,
    pose: RigidTransform,
    settings: BimccSettings = DEFAULT,
    iterations: int = 0,
    *,
    is_converged: bool = True,
) -> Solution:
    """A pose (`scene_from_bone`) as the solution of some solver: how well it fits, unmoved."""
    fit = _Fit(scene, model, pose, settings)
    if len(scene) < MIN_POINTS:
        return fit.too_few_points(len(scene))
    fit.pair(0.0)
    return fit.solution(iterations, is_converged=is_converged)


class _Near(NamedTuple):
    """Which pairs (n,) lie within reach of a kernel, and all pairs' distances and deviations."""

    sigma_mm: float
    noise_mm2: float
    distance_mm: FloatArray
    deviation_mm: FloatArray
    is_near: NDArray[np.bool_]


class _Fit:
    """Buffers and pose of one fit."""

    def __init__(
        self, scene: Scene, model: RegistrationModel, start: RigidTransform, settings: BimccSettings
    ) -> None:
        self._scene, self._model = scene, model
        self._start, self._settings = start, settings
        # The loops work in the bone's frame, where the model does not move.
        self._pose = Pose(*start.inverse_parts())
        self._has_moved = False
        # The coarse loop asks at most twice the model points that are wanted.
        n_coarse = len(scene) // scene.every + 1 + 2 * settings.model_points
        self._pairs = make_pairs(max(len(scene), n_coarse))
        self._n, self._sigma_mm = 0, 0.0
        self._thickness: ThicknessFit | None = None  # where it was fitted with the pose

    @property
    def pose(self) -> RigidTransform:
        """`scene_from_bone` as it stands."""
        start = self._start
        inverse = RigidTransform.from_parts(start.source, start.target, *self._pose)
        return inverse.inverse() if self._has_moved else start

    def run(self) -> tuple[int, bool]:
        """Both loops: how many steps, and whether they converged."""
        coarse = self.run_coarse()
        if not coarse.has_finished:
            self.pair(coarse.sigma_mm)
            return coarse.iterations, False
        fine: LoopState = run_fine_loop(
            self._scene.arrays, self._model.arrays, self._pose, self._pairs, coarse.sigma_mm,
            self._settings,
        )  # fmt: skip
        self._has_moved = True
        self._n, self._sigma_mm = fine.n_pairs, fine.sigma_mm
        return coarse.iterations + fine.iterations, fine.has_finished

    def fit_thickness(self, field: ThicknessField) -> tuple[int, bool]:
        """Pose and cartilage together, from where the loops ended: how many steps, whether at rest.

        At first the kernel is as wide as the plan's deviation, to reach what the thickness
        explains; then as narrow as the noise.
        """
        fit, settings = ThicknessFit(field, self._pairs, self._n), self._settings
        if len(fit.unknowns) == 0:
            return 0, True
        self._thickness, is_at_rest, n_rounds = fit, False, 0
        while not is_at_rest and n_rounds < _MOST_THICKNESS_ROUNDS:
            self.pair(self._sigma_mm)
            is_wide = n_rounds < _WIDE_ROUNDS
            kernel = KernelWidth(self._sigma_mm, settings.n_sigmas, is_wide)
            sharing = self._scene.n_sharing_errors
            turn_rad, shift_mm = fit.step(self._pairs, self._n, kernel, sharing, self._pose)
            is_small = max(turn_rad / settings.stop_rad, shift_mm / settings.stop_mm) < NEARLY
            is_at_rest = is_small and not is_wide
            n_rounds += 1
        return n_rounds, is_at_rest

    def run_coarse(self) -> LoopState:
        """The coarse loop, on thinned points; forward pairs only when the start is near."""
        arrays, model, settings = self._scene.arrays, self._model.arrays, self._settings
        sigma_mm = choose_first_sigma_mm(arrays, model, self._pose, self._pairs, settings)
        if sigma_mm <= settings.narrowest_mm:
            return LoopState(0, sigma_mm > 0.0, sigma_mm, 0)
        # Backward pairs are for finding the way; a near start does without the grid they need.
        is_forward_only = sigma_mm <= _NEAR_SIGMA_MM or not self._model.pairs_backward
        grid = NO_GRID if is_forward_only else self._scene.grid
        state: LoopState = run_coarse_loop(
            arrays, grid, model, self._pose, self._pairs, sigma_mm, settings
        )
        self._has_moved = True
        return state

    def pair(self, sigma_mm: float) -> None:
        """Pair all points forward where the pose stands."""
        arrays, model = self._scene.arrays, self._model.arrays
        self._n = pair_forward(arrays, model, self._pose, 1, self._pairs)
        measure_pairs(arrays, model, self._pose, self._pairs, self._n)
        self._sigma_mm = sigma_mm

    def find_near(self) -> _Near:
        """Which of the last pairs lie within reach of the kernel."""
        pairs, n, settings = self._pairs, self._n, self._settings
        sigma_mm, noise_mm2 = settings.narrowest_mm, 0.0
        if not self._scene.knows_noise:
            sigma_mm, noise_mm2 = self._find_noise()
        distance_mm = np.hypot(pairs.residual[:n], pairs.excess[:n])
        deviation_mm = np.sqrt(pairs.variance[:n] + noise_mm2)
        reach_mm = _REACH_SIGMAS * np.maximum(sigma_mm, settings.n_sigmas * deviation_mm)
        return _Near(sigma_mm, noise_mm2, distance_mm, deviation_mm, distance_mm < reach_mm)

    def _find_noise(self) -> tuple[float, float]:
        """Width of the kernel and variance of the noise that agree with each other."""
        settings = self._settings
        sigma_mm = self._sigma_mm or settings.widest_at_rest_mm
        for _ in range(_NOISE_ROUNDS):
            sums = weigh(self._pairs, self._n, sigma_mm, settings.n_sigmas, 0.0)
            noise_mm2 = float(noise_under_kernel_mm2(sums.squares_mm2, sums.kernels, sigma_mm))
            wanted_mm = follow_noise_mm(noise_mm2**0.5, sigma_mm, settings)
            if wanted_mm == sigma_mm:
                break
            sigma_mm = wanted_mm
        return sigma_mm, noise_mm2

    def solution(self, iterations: int, *, is_converged: bool) -> Solution:
        """The pose with the figures of its pairs, of those within reach of the kernel."""
        pairs, n, near, thickness = self._pairs, self._n, self.find_near(), self._thickness
        n_near = int(np.count_nonzero(near.is_near))
        if n_near < MIN_POINTS:
            return self.too_few_points(n_near, iterations)
        sums = weigh(pairs, n, near.sigma_mm, self._settings.n_sigmas, near.noise_mm2)
        pairs.weight[:n] *= near.is_near
        pose = self.pose
        information = compute_information(
            pairs._replace(direction=self._model.smooth_normals.take(pairs.vertex[:n], axis=0)),
            n, pose, self._model.centre_mm, self._scene.n_sharing_errors,
            tells_size=self._scene.tells_shape,
            thickness_rows_mm=None if thickness is None else thickness.rows_mm,
        )  # fmt: skip
        reasons = [] if is_converged else [Reason.NOT_CONVERGED]
        reasons += [Reason.DEGENERATE] * information.is_degenerate
        is_inlier = near.distance_mm < 3.0 * near.deviation_mm
        estimate = PoseEstimate(
            pose,
            information.covariance,
            n_points=n_near,
            inlier_fraction=float(is_inlier[near.is_near].mean()),
            rms_mm=float(np.sqrt(sums.squares_mm2 / sums.kernels)),
            expected_rms_mm=float(np.sqrt(sums.variances_mm2 / sums.kernels)),
            iterations=iterations,
            is_converged=is_converged,
            reasons=tuple(reasons),
            sized=information.sized,
            thickness_ratio=None if thickness is None else thickness.find_ratio(pairs.weight[:n]),
        )
        fits = np.flatnonzero(near.distance_mm < near.sigma_mm)
        points_mm, residual_mm = pairs.point.take(fits, axis=0), pairs.residual[fits]
        return Solution(estimate, information, near.sigma_mm, points_mm, residual_mm)

    def too_few_points(self, n_points: int, iterations: int = 0) -> Solution:
        """The solution that says so."""
        estimate = PoseEstimate(
            self.pose, np.diag([np.inf] * 6), n_points, 0.0, np.inf, np.inf, iterations, False,
            (Reason.TOO_FEW_POINTS,),
        )  # fmt: skip
        return Solution(estimate, None, 0.0, np.empty((0, 3)), np.empty(0))
