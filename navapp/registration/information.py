"""What residuals fix and what they leave free: covariance, degeneracy, blocks of several kinds."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.pairing_kernels import Pairs
from navapp.registration.step_kernels import (
    FREE_SHARE,
    noise_under_kernel_mm2,
    plane_system,
    size_terms,
    weighted_centre,
)
from navapp.values import PoseEstimate, Reason

_SINGULAR_SHARE = 1e-9
# A free direction turns when this much of it, in levers, is rotation; else it is a translation.
_TURN_SHARE = 0.1
# A residual further off than this, in sigma of itself and of the pose, belongs to something else.
_GATE_SIGMAS = 3.0
# Width of the kernel in sigma: 97 % of the efficiency of least squares (as `BimccSettings`).
_KERNEL_SIGMAS = 2.5
_ROUNDS = 6
# Chi-square of 6 degrees of freedom at 95 %: blocks that pull further apart are not joined.
_APART = 12.59
# What a block's residuals say of its noise counts beside what it claims, which counts as so many.
_CLAIM_COUNT = 6.0
# Those residuals of a wrong pose that happen to be small agree with it: they must not speak for the
# rest. Of right ones most are near (docs/registration.md), fewer where tissue covers the rim.
_MOST_FAR, _BY_CHANCE = 0.5, 1.0
_FEWEST = 6.0
# Residuals that show nothing at all (drawn data) still leave a scale.
_LEAST_SQUARED_RATIO = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Information:
    """How well a scene fixes a pose.

    Attributes:
        covariance: (6, 6) of the public twist (translation mm, rotation rad; from the left, about
            the model's centre); infinite when a direction is not fixed at all.
        free: (K, 6) directions that are not fixed, as twists about the seen surface's centre in
            levers: unit vectors, translation first, in the scene's frame.
        size_mm: by how much the pairs show the seen surface to be larger than the model's, at its
            rms distance from its centre.
        size_sigma_mm: standard deviation of that; infinite when nothing fixes it.
    """

    covariance: FloatArray
    free: FloatArray
    size_mm: float = 0.0
    size_sigma_mm: float = math.inf

    @property
    def is_degenerate(self) -> bool:
        """Whether some direction is free."""
        return len(self.free) > 0

    def free_in_words(self) -> list[str]:
        """The free directions for people: rotations first, as many as there are, then shifts."""
        if not self.is_degenerate:
            return []
        # Mixed so that the rotations stand in as few directions as can be.
        mixing, turns, _ = np.linalg.svd(self.free[:, 3:])
        mixed = mixing.T @ self.free
        is_turn = np.append(turns, np.zeros(len(mixed)))[: len(mixed)] > _TURN_SHARE
        return [
            f"rotation about {_axis(twist[3:])}"
            if turning
            else f"translation along {_axis(twist[:3])}"
            for twist, turning in zip(mixed, is_turn, strict=True)
        ]


def information_of(
    pairs: Pairs, n: int, pose: RigidTransform, centre_mm: FloatArray, n_sharing_errors: float
) -> Information:
    """Information of weighted pairs about a pose.

    Args:
        pairs: weighted by kernel over variance, in bone coordinates; first n hold.
        n: how many.
        pose: `scene_from_bone`.
        centre_mm: (3,) of the model, bone coordinates.
        n_sharing_errors: so many neighbouring pairs have their errors in common.

    Source: Gauss-Newton normal equations at the solution; their inverse is the covariance.
    """
    H, g, seen_mm = np.empty((6, 6)), np.empty(6), np.empty(3)
    lever_mm = float(weighted_centre(pairs, n, seen_mm))
    plane_system(pairs, n, seen_mm, lever_mm, H, g)
    eigenvalues, vectors = np.linalg.eigh(H)
    is_free = eigenvalues < FREE_SHARE * eigenvalues[-1]
    # (rotation x lever, translation) of the points become (translation, rotation) of the pose.
    turned = np.zeros((6, 6))
    turned[:3, 3:] = turned[3:, :3] = pose.rotation
    free = (turned @ vectors[:, is_free]).T
    if eigenvalues[0] <= _SINGULAR_SHARE * eigenvalues[-1]:
        return Information(np.diag([np.inf] * 6), free)
    size_mm, size_variance = _size(pairs, n, seen_mm, lever_mm, H, g)
    plane_system(pairs, n, np.ascontiguousarray(centre_mm), lever_mm, H, g)
    levers = np.diag([1.0, 1.0, 1.0, 1.0 / lever_mm, 1.0 / lever_mm, 1.0 / lever_mm])
    change = levers @ turned
    covariance = n_sharing_errors * change @ np.linalg.inv(H) @ change.T
    size_sigma_mm = math.sqrt(n_sharing_errors * size_variance)
    return Information(0.5 * (covariance + covariance.T), free, size_mm, size_sigma_mm)


def _size(
    pairs: Pairs, n: int, seen_mm: FloatArray, lever_mm: float, H: FloatArray, g: FloatArray
) -> tuple[float, float]:
    """Size as a seventh unknown beside the six of the motion, and its variance.

    Source: elimination of the motion from the normal equations (Schur complement).
    """
    mixed = np.empty(6)
    terms = size_terms(pairs, n, seen_mm, lever_mm, mixed)
    by_motion = np.linalg.solve(H, np.column_stack([mixed, g]))
    information = terms.squares - float(mixed @ by_motion[:, 0])
    if information <= _SINGULAR_SHARE * terms.squares:
        return 0.0, math.inf
    return (terms.product_mm - float(mixed @ by_motion[:, 1])) / information, 1.0 / information


def _axis(vector: FloatArray) -> str:
    """Direction of a vector, its largest component positive."""
    axis = vector / np.linalg.norm(vector)
    axis = axis * np.sign(axis[np.abs(axis).argmax()])
    x, y, z = (round(float(value), 2) + 0.0 for value in axis)
    return f"({x:g}, {y:g}, {z:g})"


@dataclass(frozen=True, slots=True, eq=False)
class ResidualBlock:
    """Residuals of one kind at a pose, r = observed - predicted, and how a motion changes them.

    Attributes:
        jacobian: (N, 6) of the prediction by the public twist: translation mm, rotation rad, from
            the left, about the model's centre.
        residual: (N,) in the block's own unit.
        variance: (N,) of them.
        n_sharing: (N,) so many residuals, itself included, share one's error.
        common_sd: standard deviation of an offset that all of them have in common.
    """

    jacobian: FloatArray
    residual: FloatArray
    variance: FloatArray
    n_sharing: FloatArray
    common_sd: float

    def only(self, is_kept: NDArray[np.bool_]) -> "ResidualBlock":
        """Those residuals; how many share an error stays, though some of them may be gone."""
        return ResidualBlock(
            self.jacobian[is_kept],
            self.residual[is_kept],
            self.variance[is_kept],
            self.n_sharing[is_kept],
            self.common_sd,
        )


def near(block: ResidualBlock, covariance: FloatArray) -> NDArray[np.bool_]:
    """(N,) residuals that a pose of that covariance allows."""
    by_pose = ((block.jacobian @ covariance) * block.jacobian).sum(axis=1)
    expected = block.variance + by_pose + block.common_sd**2
    answer: NDArray[np.bool_] = block.residual**2 < _GATE_SIGMAS**2 * expected
    return answer


def join(
    estimate: PoseEstimate,
    kernel_sigmas: float,
    block: ResidualBlock,
    centre_mm: FloatArray,
    noise_variance_ratio: float = 1.0,
) -> PoseEstimate:
    """A pose that was fitted to a surface, moved to what it and a further block say together.

    Args:
        estimate: at its optimum; its covariance is the surface block's information.
        kernel_sigmas: width of the kernel it was fitted with, in sigma.
        block: linearised at that pose.
        centre_mm: (3,) the model's centre at that pose, in the camera's frame.
        noise_variance_ratio: variance that the surface's noise has, over the one that it claims.

    Returns:
        The surface's pose when the block says too little or pulls too far away; with the reason
        that the cues disagree when too much of the block is further off than the estimate allows.

    Both blocks claim a noise and show one in their residuals. The pose is found with the noise they
    show, so that a block that claims too much of itself does not outweigh one that claims too
    little; the covariance is that of this pose under the noise that they have.

    Source: Gauss-Newton on the sum of squares, kernel weights as in `step_kernels.weigh`; variance
    components after Foerstner 1979; covariance of an estimator with other weights than its noise's.
    """
    alone = replace(estimate, covariance=noise_variance_ratio * estimate.covariance)
    is_near = near(block, estimate.covariance)
    count_all, count_near = (float((1.0 / block.n_sharing[kept]).sum()) for kept in (..., is_near))
    if count_all < _FEWEST:
        return alone
    if count_all - count_near > _MOST_FAR * count_all + _BY_CHANCE:
        return alone.with_reason(Reason.CUES_DISAGREE)
    if count_near < _FEWEST:
        return alone
    joined = _solve_joined(
        estimate, kernel_sigmas, block.only(is_near), centre_mm, noise_variance_ratio
    )
    return alone if joined is None else joined


def _solve_joined(
    estimate: PoseEstimate,
    kernel_sigmas: float,
    block: ResidualBlock,
    centre_mm: FloatArray,
    noise_variance_ratio: float,
) -> PoseEstimate | None:
    """What a surface and residuals that agree with it say together; None when they pull apart."""
    surface = np.zeros((7, 7))
    surface[:6, :6] = np.linalg.inv(estimate.covariance)
    surface_scale = min(_ratio_without_kernel(_squared_rms_ratio(estimate), kernel_sigmas), 1.0)
    offset = np.zeros((7, 7))
    offset[6, 6] = 1.0 / block.common_sd**2
    rows = np.column_stack([block.jacobian, np.ones(len(block.residual))])
    step: FloatArray = np.zeros(7)
    scale = 1.0
    for _ in range(_ROUNDS):
        rest = block.residual - rows @ step
        kernel = np.exp(-0.5 * rest**2 / (_KERNEL_SIGMAS**2 * block.variance))
        count = kernel / block.n_sharing
        scale = _scale(rest, count, block.variance)
        weighted = rows.T * (count / block.variance)
        information = weighted @ rows
        normal = surface / surface_scale + offset + information / scale
        step = np.asarray(
            np.linalg.solve(normal, weighted @ block.residual / scale), dtype=np.float64
        )
    if step @ surface @ step > _APART:
        return None
    inverse = np.linalg.inv(normal)
    # A block that shows more noise than it claims is believed.
    by_surface = noise_variance_ratio * surface / surface_scale**2
    by_block = information * max(scale, 1.0) / scale**2
    covariance = (inverse @ (by_surface + offset + by_block) @ inverse)[:6, :6]
    pose = estimate.camera_from_bone.move(step[:6], centre_mm)
    return replace(estimate, camera_from_bone=pose, covariance=0.5 * (covariance + covariance.T))


def _scale(rest: FloatArray, count: FloatArray, variance: FloatArray) -> float:
    """Variance that residuals show over the one they claim, drawn to 1 when they are few."""
    n = float(count.sum())
    shown = _ratio_without_kernel(
        float((count * rest**2 / variance).sum()) / max(n, 1e-12), _KERNEL_SIGMAS
    )
    return (_CLAIM_COUNT + n * shown) / (_CLAIM_COUNT + n)


def _ratio_without_kernel(ratio2: float, kernel_sigmas: float) -> float:
    """The same of residuals without a kernel, from those under one."""
    return float(noise_under_kernel_mm2(ratio2, 1.0, kernel_sigmas))


def _squared_rms_ratio(estimate: PoseEstimate) -> float:
    return max((estimate.rms_mm / estimate.expected_rms_mm) ** 2, _LEAST_SQUARED_RATIO)
