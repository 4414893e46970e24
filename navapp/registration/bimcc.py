"""Production BiMCC-ICP: bidirectional maximum correntropy against what one camera can see.

From far, thinned points pair both ways and the kernel narrows; at rest, all points pair forward
under a kernel as narrow as the noise (equations in docs/registration.md).
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.bimcc_kernels import (
    LoopSettings,
    LoopState,
    first_sigma_mm,
    loop_from_far,
    loop_to_rest,
)
from navapp.registration.information import Information, information_of
from navapp.registration.model import RegistrationModel
from navapp.registration.pairing_kernels import make_pairs, measure_pairs, pair_forward
from navapp.registration.scene import NO_GRID, Scene
from navapp.registration.step_kernels import noise_under_kernel_mm2, weigh
from navapp.values import PoseEstimate, Reason

MIN_POINTS = 60
# Pairs that are longer than so many widths of the kernel take no part in the figures.
_REACH_SIGMAS, _NOISE_ROUNDS = 4.0, 20
# A first kernel of this width means a start some millimetres off.
_NEAR_SIGMA_MM = 5.0


@dataclass(frozen=True, slots=True)
class BimccSettings:
    """How the estimator works.

    Attributes:
        widest_mm: the kernel at most, and the longest backward pair.
        narrowest_mm: the kernel at least.
        n_sigmas: the kernel's width in standard deviations of the noise; at 2.5 it keeps 97 % of
            the efficiency that least squares has on pure noise, at 1.6 it keeps 88 %.
        largest_noise_mm: points noisier than this are not expected.
        backward_weight: what all backward pairs weigh beside all forward pairs.
        point_weight: what the whole distance of a pair weighs beside its plane's, from far.
        model_points: so many model points ask backward, about.
        max_iterations: of each loop.
        settled_mm, settled_rad: a smaller step ends the fit.
    """

    widest_mm: float = 12.0
    narrowest_mm: float = 0.3
    n_sigmas: float = 2.5
    largest_noise_mm: float = 1.0
    backward_weight: float = 1.5
    point_weight: float = 0.1
    model_points: int = 1500
    max_iterations: int = 60
    settled_mm: float = 2e-3
    settled_rad: float = 2e-5

    @property
    def widest_at_rest_mm(self) -> float:
        """The kernel over the largest noise: one that stays as wide has met something else."""
        return self.n_sigmas * self.largest_noise_mm


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A pose and what stands behind it.

    Attributes:
        estimate: the pose with its covariance.
        information: what the pairs fix, and what they leave free; None when too few pair.
        sigma_mm: width of the kernel at the end.
        points_mm, residual_mm: (M, 3) in bone coordinates and (M,), of the pairs that fit.
    """

    estimate: PoseEstimate
    information: Information | None
    sigma_mm: float
    points_mm: FloatArray
    residual_mm: FloatArray

    def with_reason(self, reason: Reason) -> "Solution":
        """The same solution with one more reason against its pose."""
        return replace(self, estimate=self.estimate.with_reason(reason))


def fit_bimcc(
    scene: Scene,
    model: RegistrationModel,
    scene_from_bone: RigidTransform,
    settings: BimccSettings | None = None,
) -> PoseEstimate:
    """Register a model to a scene from a start.

    Args:
        scene: what was measured.
        model: prepared bone.
        scene_from_bone: start.
        settings: of the estimator.

    Returns:
        The pose with covariance; when too few points pair, the reasons say so.

    Source: the paper, proposed equations 4 to 9 (corrected), Algorithm 2; Chen and Medioni 1992.
    """
    return solve_bimcc(scene, model, scene_from_bone, settings).estimate


def solve_bimcc(
    scene: Scene,
    model: RegistrationModel,
    scene_from_bone: RigidTransform,
    settings: BimccSettings | None = None,
) -> Solution:
    """As `fit_bimcc`, with the figures."""
    fit = _Fit(scene, model, scene_from_bone, settings or BimccSettings())
    if len(scene) < MIN_POINTS:
        return fit.too_few_points(len(scene))
    iterations, is_converged = fit.run()
    return fit.solution(iterations, is_converged=is_converged)


def fit_pose(
    scene: Scene,
    model: RegistrationModel,
    scene_from_bone: RigidTransform,
    settings: BimccSettings,
) -> RigidTransform | None:
    """The pose of `fit_bimcc` without its figures; None when too few points pair."""
    fit = _Fit(scene, model, scene_from_bone, settings)
    if len(scene) < MIN_POINTS:
        return None
    fit.run()
    return fit.pose if fit.reach().n_near >= MIN_POINTS else None


def fit_coarsely(
    scene: Scene,
    model: RegistrationModel,
    scene_from_bone: RigidTransform,
    settings: BimccSettings,
) -> RigidTransform | None:
    """The loop from far alone: where a start leads to, on thinned points; None to nowhere."""
    fit = _Fit(scene, model, scene_from_bone, settings)
    return fit.pose if fit.from_far().has_finished else None


def estimate_at(
    scene: Scene,
    model: RegistrationModel,
    scene_from_bone: RigidTransform,
    settings: BimccSettings | None = None,
) -> PoseEstimate:
    """How well a pose fits a scene, without moving it."""
    return solution_at(scene, model, scene_from_bone, settings or BimccSettings()).estimate


def solution_at(
    scene: Scene,
    model: RegistrationModel,
    pose: RigidTransform,
    settings: BimccSettings,
    iterations: int = 0,
    *,
    is_converged: bool = True,
) -> Solution:
    """A pose as the solution of some solver, with its figures."""
    fit = _Fit(scene, model, pose, settings)
    if len(scene) < MIN_POINTS:
        return fit.too_few_points(len(scene))
    fit.pair(0.0)
    return fit.solution(iterations, is_converged=is_converged)


class _Reach(NamedTuple):
    """Pairs within reach of the kernel.

    Attributes:
        sigma_mm: width of the kernel.
        noise_mm2: variance that the points do not know of themselves.
        distance: (n,) of each pair, mm.
        deviation: (n,) its standard deviation, mm.
        is_near, n_near: (n,) within reach, and how many are.
    """

    sigma_mm: float
    noise_mm2: float
    distance: FloatArray
    deviation: FloatArray
    is_near: NDArray[np.bool_]
    n_near: int


class _Fit:
    """Buffers and pose of one fit."""

    def __init__(
        self,
        scene: Scene,
        model: RegistrationModel,
        scene_from_bone: RigidTransform,
        settings: BimccSettings,
    ) -> None:
        self._scene, self._model, self._start = scene, model, scene_from_bone
        self._settings = settings
        # The loops work in the bone's frame, where the model rests.
        self._rotation, self._shift = scene_from_bone.inverse_parts()
        self._has_moved = False
        self._model_every = max(1, len(model.points_mm) // settings.model_points)
        n_backward = len(model.points_mm) // self._model_every + 1
        self._pairs = make_pairs(max(len(scene), len(scene) // scene.every + 1 + n_backward))
        self._n, self._sigma_mm = 0, 0.0

    @property
    def pose(self) -> RigidTransform:
        """`scene_from_bone` as it stands."""
        if not self._has_moved:
            return self._start
        inverse = RigidTransform.from_parts(
            self._start.source, self._start.target, self._rotation, self._shift
        )
        return inverse.inverse()

    def run(self) -> tuple[int, bool]:
        """From far, then to rest: so many steps, and whether the pose has settled."""
        far = self.from_far()
        if not far.has_finished:
            self.pair(far.sigma_mm)
            return far.iterations, False
        rest = self.to_rest(far.sigma_mm)
        return far.iterations + rest.iterations, rest.has_finished

    def from_far(self) -> LoopState:
        """Thinned, both ways; forward only when the start is near, not at all when it is there."""
        arrays, model, settings = self._scene.arrays, self._model.arrays, self._loop_settings()
        sigma_mm = first_sigma_mm(arrays, model, self._rotation, self._shift, self._pairs, settings)
        if sigma_mm <= settings.narrowest_mm:
            return LoopState(0, sigma_mm > 0.0, sigma_mm, 0, 0.0)
        # Backward pairs are for finding the way; a near start does without the grid they need.
        grid = NO_GRID if sigma_mm <= _NEAR_SIGMA_MM else self._scene.grid
        state: LoopState = loop_from_far(
            arrays, grid, model, self._rotation, self._shift, self._pairs, sigma_mm,
            settings,
        )  # fmt: skip
        self._has_moved = True
        return state

    def to_rest(self, sigma_mm: float) -> LoopState:
        """All points, forward."""
        state: LoopState = loop_to_rest(
            self._scene.arrays, self._model.arrays, self._rotation, self._shift, self._pairs,
            sigma_mm, self._loop_settings(),
        )  # fmt: skip
        self._has_moved = True
        self._n, self._sigma_mm = state.n_pairs, state.sigma_mm
        return state

    def pair(self, sigma_mm: float) -> None:
        """Pair all points forward where the pose stands."""
        arrays, model = self._scene.arrays, self._model.arrays
        rotation, shift = self._rotation, self._shift
        camera = rotation @ arrays.camera + shift
        self._n = pair_forward(arrays, model, rotation, shift, camera, 1, self._pairs)
        measure_pairs(arrays, model, rotation, shift, camera, self._pairs, 0, self._n)
        self._sigma_mm = sigma_mm

    def reach(self) -> _Reach:
        """Which of the last pairs lie within reach of the kernel."""
        pairs, n, settings = self._pairs, self._n, self._settings
        sigma_mm, noise_mm2 = settings.narrowest_mm, 0.0
        if not self._scene.knows_noise:
            sigma_mm, noise_mm2 = self._own_noise()
        distance = np.hypot(pairs.residual[:n], pairs.excess[:n])
        deviation = np.sqrt(pairs.variance[:n] + noise_mm2)
        is_near = distance < _REACH_SIGMAS * np.maximum(sigma_mm, settings.n_sigmas * deviation)
        n_near = int(np.count_nonzero(is_near))
        return _Reach(sigma_mm, noise_mm2, distance, deviation, is_near, n_near)

    def solution(self, iterations: int, *, is_converged: bool) -> Solution:
        """The pose with the figures of its pairs, of those within reach of the kernel."""
        pairs, n, settings = self._pairs, self._n, self._settings
        sigma_mm, noise_mm2, distance, deviation, is_near, n_near = self.reach()
        if n_near < MIN_POINTS:
            return self.too_few_points(n_near, iterations)
        sums = weigh(pairs, n, sigma_mm, settings.n_sigmas, noise_mm2)
        pairs.weight[:n] *= is_near
        pose = self.pose
        smooth = pairs._replace(direction=self._model.smooth_normals[pairs.vertex[:n]])
        information = information_of(
            smooth, n, pose, self._model.centre_mm, self._scene.n_sharing_errors
        )
        reasons = [] if is_converged else [Reason.NOT_CONVERGED]
        reasons += [Reason.DEGENERATE] * information.is_degenerate
        estimate = PoseEstimate(
            pose,
            information.covariance,
            n_near,
            float((distance < 3.0 * deviation)[is_near].mean()),
            float(np.sqrt(sums.squares_mm2 / sums.kernels)),
            float(np.sqrt(sums.variances_mm2 / sums.kernels)),
            iterations,
            is_converged,
            tuple(reasons),
            information.size_mm,
            information.size_sigma_mm,
        )
        fits = distance < sigma_mm
        return Solution(
            estimate, information, sigma_mm, pairs.point[:n][fits], pairs.residual[:n][fits]
        )

    def too_few_points(self, n_points: int, iterations: int = 0) -> Solution:
        """The solution that says so."""
        estimate = PoseEstimate(
            self.pose, np.diag([np.inf] * 6), n_points, 0.0, np.inf, np.inf, iterations, False,
            (Reason.TOO_FEW_POINTS,),
        )  # fmt: skip
        return Solution(estimate, None, 0.0, np.empty((0, 3)), np.empty(0))

    def _own_noise(self) -> tuple[float, float]:
        """Width of the kernel and variance of the noise that agree with each other."""
        settings = self._settings
        widest_mm = settings.widest_at_rest_mm
        sigma_mm, noise_mm2 = self._sigma_mm or widest_mm, 0.0
        for _ in range(_NOISE_ROUNDS):
            sums = weigh(self._pairs, self._n, sigma_mm, settings.n_sigmas, 0.0)
            noise_mm2 = float(noise_under_kernel_mm2(sums.squares_mm2, sums.kernels, sigma_mm))
            wanted_mm = settings.n_sigmas * noise_mm2**0.5
            wanted_mm = min(max(wanted_mm, settings.narrowest_mm), widest_mm)
            if abs(wanted_mm - sigma_mm) < 0.02 * sigma_mm:
                break
            sigma_mm = wanted_mm
        return sigma_mm, noise_mm2

    def _loop_settings(self) -> LoopSettings:
        settings = self._settings
        return LoopSettings(
            widest_mm=settings.widest_mm,
            narrowest_mm=settings.narrowest_mm,
            n_sigmas=settings.n_sigmas,
            widest_at_rest_mm=settings.widest_at_rest_mm,
            knows_noise=self._scene.knows_noise,
            backward_weight=settings.backward_weight,
            point_weight=settings.point_weight,
            scene_every=self._scene.every,
            model_every=self._model_every,
            max_iterations=settings.max_iterations,
            settled_rad=settings.settled_rad,
            settled_mm=settings.settled_mm,
        )
