"""What residuals fix and what they leave free: covariance, degeneracy, blocks of several kinds."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.pairing_kernels import Pairs
from navapp.registration.step_kernels import (
    FREE_FRACTION,
    find_weighted_centre,
    noise_under_kernel_mm2,
    sum_plane_system,
    sum_size_terms,
)
from navapp.values import PoseEstimate, Reason

# Chosen, as all that names no source.
_SINGULAR_FRACTION = 1e-9
# A free direction turns when this much of it, in levers, is rotation; else it is a translation.
_TURN_FRACTION = 0.1
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
# others. Of right ones most are near (`python -m tests.bench.outline`), fewer where tissue covers
# the rim.
_MOST_FAR, _BY_CHANCE = 0.5, 1.0
_FEWEST = 6.0
# By how much the surface of a bone differs from its model beyond what the plan tells, along its
# normal (standard deviation), and over which distance that goes together (tests.bench.bounds).
RELIEF_SD_MM, RELIEF_LENGTH_MM = 0.033, 4.0
# Residuals that show nothing at all (drawn data) still leave a scale.
_LEAST_SQUARED_RATIO = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Information:
    """How well a scene fixes a pose."""

    # (6, 6) of the public twist (translation mm, rotation rad; from the left, about the model's
    # centre); infinite when a direction is not fixed at all.
    covariance: FloatArray
    # (K, 6) directions that are not fixed, as twists about the seen surface's centre in levers:
    # unit vectors, translation first, in the scene's frame.
    free: FloatArray
    # by how much the pairs show the seen surface to be larger than the model's, at its rms distance
    # from its centre.
    size_mm: float = 0.0
    size_sigma_mm: float = math.inf  # standard deviation of that; infinite when nothing fixes it
    # (6, 6) as `covariance`: what the bone's relief adds to it.
    relief_covariance: FloatArray = field(default_factory=lambda: np.zeros((6, 6)))
    # (6,) public twist by which the pose would differ if the model had the size that is seen.
    size_twist: FloatArray = field(default_factory=lambda: np.zeros(6))

    @property
    def is_degenerate(self) -> bool:
        """Whether some direction is free."""
        return len(self.free) > 0

    def free_in_words(self) -> list[str]:
        """The free directions for people: rotations first, as many as there are, then shifts."""
        # Mixed so that the rotations stand in as few directions as can be.
        mixing, turns, _ = np.linalg.svd(self.free[:, 3:])
        mixed = mixing.T @ self.free
        n_turns = int((turns > _TURN_FRACTION).sum())
        return [
            *(f"rotation about {_name_axis(twist[3:])}" for twist in mixed[:n_turns]),
            *(f"translation along {_name_axis(twist[:3])}" for twist in mixed[n_turns:]),
        ]


def compute_information(
    pairs: Pairs,
    n: int,
    pose: RigidTransform,
    centre_mm: FloatArray,
    n_sharing_errors: float,
    n_sharing_relief: float = 0.0,
) -> Information:
    """Information of the first n pairs, weighted by kernel over variance, about `scene_from_bone`.

    Pairs and the model's centre (3,) are in bone coordinates. So many neighbouring pairs as
    `n_sharing_errors` have their errors in common, and so many as `n_sharing_relief` the relief by
    which the bone differs from its model.

    Source: Gauss-Newton normal equations at the solution; their inverse is the covariance. That of
    the relief is the one of an estimator whose weights do not know it.
    """
    seen_mm, lever_mm = find_weighted_centre(pairs, n)
    H, g = sum_plane_system(pairs, n, seen_mm, lever_mm)
    eigenvalues, vectors = np.linalg.eigh(H)
    is_free = _are_free(eigenvalues)
    # (rotation x lever, translation) of the points become (translation, rotation) of the pose.
    turned = np.zeros((6, 6))
    turned[:3, 3:] = turned[3:, :3] = pose.rotation
    free = (turned @ vectors[:, is_free]).T
    if eigenvalues[0] <= _SINGULAR_FRACTION * eigenvalues[-1]:
        return Information(np.diag([np.inf] * 6), free)
    # The size is a seventh unknown; the motion is eliminated (Schur complement).
    mixed, squares, product_mm = sum_size_terms(pairs, n, seen_mm, lever_mm)
    by_motion = np.linalg.solve(H, np.column_stack([mixed, g]))
    size_information = squares - float(mixed @ by_motion[:, 0])
    size_mm, size_variance = 0.0, math.inf
    if size_information > _SINGULAR_FRACTION * squares:
        size_mm = (product_mm - float(mixed @ by_motion[:, 1])) / size_information
        size_variance = 1.0 / size_information
    # The points' motion, the other way. Growth about the seen centre moves the model's as well.
    by_size, arm_mm = -by_motion[:, 0], centre_mm - seen_mm
    turn = by_size[:3] / lever_mm
    shift = by_size[3:] + np.cross(turn, arm_mm) + arm_mm / lever_mm
    size_twist = size_mm * np.concatenate([pose.rotation @ shift, pose.rotation @ turn])
    H, _ = sum_plane_system(pairs, n, centre_mm, lever_mm)
    change = np.diag([1.0] * 3 + [1.0 / lever_mm] * 3) @ turned
    inverse = np.linalg.inv(H)
    covariance = n_sharing_errors * change @ inverse @ change.T
    relief = np.zeros((6, 6))
    if n_sharing_relief > 0.0:
        squared, _ = sum_plane_system(
            pairs._replace(weight=pairs.weight**2), n, centre_mm, lever_mm
        )
        relief = n_sharing_relief * RELIEF_SD_MM**2 * (inverse @ squared @ inverse)
        relief = change @ relief @ change.T
    size_sigma_mm = math.sqrt(n_sharing_errors * size_variance)
    covariance, relief = (0.5 * (one + one.T) for one in (covariance, relief))
    return Information(covariance, free, size_mm, size_sigma_mm, relief, size_twist)


def _are_free(eigenvalues: FloatArray) -> NDArray[np.bool_]:
    """(n,) directions that are not fixed, of the ascending eigenvalues of an information."""
    # What is not a number fixes nothing.
    is_free: NDArray[np.bool_] = ~(eigenvalues >= FREE_FRACTION * eigenvalues[-1])
    return is_free


def leaves_direction_free(
    covariance: FloatArray, centre_mm: FloatArray, seen_mm: FloatArray
) -> bool:
    """Whether some direction of a pose is not fixed, as `compute_information` judges it.

    All points of the seen surface count alike for its centre and lever. Without any all is free.

    Args:
        covariance: (6, 6) of the public twist about `centre_mm`.
        centre_mm: (3,) the model's centre.
        seen_mm: (N, 3) the seen surface, in the same frame.
    """
    if len(seen_mm) == 0:
        return True
    middle_mm = seen_mm.mean(axis=0)
    lever_mm = math.sqrt(((seen_mm - middle_mm) ** 2).sum(axis=1).mean())
    x, y, z = middle_mm - centre_mm
    about_seen = np.eye(6)
    about_seen[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    about_seen[3:] *= lever_mm
    spread = np.linalg.eigvalsh(about_seen @ covariance @ about_seen.T)
    return bool(_are_free(1.0 / np.maximum(spread[::-1], np.finfo(float).tiny)).any())


def _name_axis(vector: FloatArray) -> str:
    """Direction of a vector, its largest component positive."""
    axis = vector / np.linalg.norm(vector)
    axis = axis * np.sign(axis[np.abs(axis).argmax()])
    x, y, z = (round(float(value), 2) + 0.0 for value in axis)
    return f"({x:g}, {y:g}, {z:g})"


@dataclass(frozen=True, slots=True, eq=False)
class ResidualBlock:
    """Residuals of one kind at a pose, r = observed - predicted, and how a motion changes them."""

    # (N, 6) of the prediction by the public twist: translation mm, rotation rad, from the left,
    # about the model's centre.
    jacobian: FloatArray
    residual: FloatArray  # (N,) in the block's own unit
    variance: FloatArray  # (N,) of them
    n_sharing: FloatArray  # (N,) so many residuals, itself included, share one's error
    common_sd: float  # standard deviation of an offset that all of them have in common

    def find_near(self, covariance: FloatArray) -> NDArray[np.bool_]:
        """(N,) residuals that a pose of that covariance allows."""
        by_pose = ((self.jacobian @ covariance) * self.jacobian).sum(axis=1)
        expected = self.variance + by_pose + self.common_sd**2
        is_near: NDArray[np.bool_] = self.residual**2 < _GATE_SIGMAS**2 * expected
        return is_near


def join(
    estimate: PoseEstimate,
    kernel_sigmas: float,
    block: ResidualBlock,
    centre_mm: FloatArray,
    seen_mm: FloatArray,
    noise_variance_ratio: float = 1.0,
) -> PoseEstimate:
    """A pose that was fitted to a surface, moved to what it and a further block say together.

    Args:
        estimate: at its optimum; its covariance is the surface block's information.
        kernel_sigmas: width of the kernel it was fitted with, in sigma.
        block: linearised at that pose.
        centre_mm: (3,) the model's centre at that pose, in the camera's frame.
        seen_mm: (N, 3) the surface that it was fitted to, in that frame.
        noise_variance_ratio: variance that the surface's noise has, over the one that it claims.

    Returns:
        The surface's pose when the block says too little or pulls too far away; with the reason
        that the cues disagree when too much of the block is further off than the estimate allows.
        A direction that the surface leaves free and the block fixes is no longer told as free.

    Both blocks claim a noise and show one in their residuals. The pose is found with the noise they
    show, so that a block that claims too much of itself does not outweigh one that claims too
    little; the covariance is that of this pose under the noise that they have.

    Source: Gauss-Newton on the sum of squares, kernel weights as in `step_kernels.weigh`; variance
    components after Foerstner 1979; covariance of an estimator with other weights than its noise's.
    """
    alone = replace(estimate, covariance=noise_variance_ratio * estimate.covariance)
    is_near = block.find_near(estimate.covariance)
    count = 1.0 / block.n_sharing
    n_all, n_near = float(count.sum()), float(count[is_near].sum())
    if n_all >= _FEWEST and n_all - n_near > _MOST_FAR * n_all + _BY_CHANCE:
        return alone.with_reason(Reason.CUES_DISAGREE)
    if n_near < _FEWEST:
        return alone
    surface = np.zeros((7, 7))
    surface[:6, :6] = np.linalg.inv(estimate.covariance)
    # What the surface's residuals show of the variance that they claim, at most all of it.
    ratio2 = max((estimate.rms_mm / estimate.expected_rms_mm) ** 2, _LEAST_SQUARED_RATIO)
    scale = min(float(noise_under_kernel_mm2(ratio2, 1.0, kernel_sigmas)), 1.0)
    step, covariance = _solve_joined(surface, scale, block, is_near, noise_variance_ratio)
    if step @ surface @ step > _APART:
        return alone
    pose = estimate.camera_from_bone.move(step[:6], centre_mm)
    covariance, reasons = 0.5 * (covariance + covariance.T), estimate.reasons
    if Reason.DEGENERATE in reasons and not leaves_direction_free(covariance, centre_mm, seen_mm):
        reasons = tuple(reason for reason in reasons if reason is not Reason.DEGENERATE)
    return replace(estimate, camera_from_bone=pose, covariance=covariance, reasons=reasons)


def _solve_joined(
    surface: FloatArray,
    surface_scale: float,
    block: ResidualBlock,
    is_near: NDArray[np.bool_],
    noise_variance_ratio: float,
) -> tuple[FloatArray, FloatArray]:
    """(7,) twist and common offset on which both agree, and the (6, 6) covariance of the twist.

    `surface` is the surface's information (7, 7), without any of the offset.
    """
    residual, variance = block.residual[is_near], block.variance[is_near]
    n_sharing = block.n_sharing[is_near]
    rows = np.column_stack([block.jacobian[is_near], np.ones(len(residual))])
    offset = np.zeros((7, 7))
    offset[6, 6] = 1.0 / block.common_sd**2
    step: FloatArray = np.zeros(7)
    for _ in range(_ROUNDS):
        misfit = residual - rows @ step
        count = np.exp(-0.5 * misfit**2 / (_KERNEL_SIGMAS**2 * variance)) / n_sharing
        n, squares = float(count.sum()), float((count * misfit**2 / variance).sum())
        # What the residuals show of their claimed variance, drawn to 1 when they are few.
        shown = float(noise_under_kernel_mm2(squares, n, _KERNEL_SIGMAS))
        scale = (_CLAIM_COUNT + n * shown) / (_CLAIM_COUNT + n)
        weighted = rows.T * (count / variance)
        information = weighted @ rows
        normal = surface / surface_scale + offset + information / scale
        step = np.asarray(np.linalg.solve(normal, weighted @ residual / scale), dtype=np.float64)
    inverse = np.linalg.inv(normal)
    # A block that shows more noise than it claims is believed.
    by_surface = noise_variance_ratio * surface / surface_scale**2
    by_block = information * max(scale, 1.0) / scale**2
    return step, (inverse @ (by_surface + offset + by_block) @ inverse)[:6, :6]
