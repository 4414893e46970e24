"""Several kinds of measurement in one estimate: residual blocks joined at a pose."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.registration.step_kernels import noise_under_kernel_mm2
from navapp.values import PoseEstimate, Reason

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
_LEAST_RATIO2 = 1e-4


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
    noise2: float = 1.0,
) -> PoseEstimate:
    """A pose that was fitted to a surface, moved to what it and a further block say together.

    Args:
        estimate: at its optimum; its covariance is the surface block's information.
        kernel_sigmas: width of the kernel it was fitted with, in sigma.
        block: linearised at that pose.
        centre_mm: (3,) the model's centre at that pose, in the camera's frame.
        noise2: variance that the surface's noise has, over the one that it claims.

    Returns:
        The surface's pose when the block says too little or pulls too far away; with the reason
        that the cues disagree when too much of the block is further off than the estimate allows.

    Both blocks claim a noise and show one in their residuals. The pose is found with the noise they
    show, so that a block that claims too much of itself does not outweigh one that claims too
    little; the covariance is that of this pose under the noise that they have.

    Source: Gauss-Newton on the sum of squares, kernel weights as in `step_kernels.weigh`; variance
    components after Foerstner 1979; covariance of an estimator with other weights than its noise's.
    """
    alone = replace(estimate, covariance=noise2 * estimate.covariance)
    is_near = near(block, estimate.covariance)
    count_all, count_near = (float((1.0 / block.n_sharing[kept]).sum()) for kept in (..., is_near))
    if count_all < _FEWEST:
        return alone
    if count_all - count_near > _MOST_FAR * count_all + _BY_CHANCE:
        return alone.doubted(Reason.CUES_DISAGREE)
    if count_near < _FEWEST:
        return alone
    block = block.only(is_near)
    surface = np.zeros((7, 7))
    surface[:6, :6] = np.linalg.inv(estimate.covariance)
    surface_scale = min(_shown(_rms_ratio2(estimate), kernel_sigmas), 1.0)
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
        return alone
    inverse = np.linalg.inv(normal)
    # A block that shows more noise than it claims is believed.
    by_surface = noise2 * surface / surface_scale**2
    by_block = information * max(scale, 1.0) / scale**2
    covariance = (inverse @ (by_surface + offset + by_block) @ inverse)[:6, :6]
    pose = estimate.camera_from_bone.moved(step[:6], centre_mm)
    return replace(estimate, camera_from_bone=pose, covariance=0.5 * (covariance + covariance.T))


def _scale(rest: FloatArray, count: FloatArray, variance: FloatArray) -> float:
    """Variance that residuals show over the one they claim, drawn to 1 when they are few."""
    n = float(count.sum())
    shown = _shown(float((count * rest**2 / variance).sum()) / max(n, 1e-12), _KERNEL_SIGMAS)
    return (_CLAIM_COUNT + n * shown) / (_CLAIM_COUNT + n)


def _shown(ratio2: float, kernel_sigmas: float) -> float:
    """The same of residuals without a kernel, from those under one."""
    return float(noise_under_kernel_mm2(ratio2, 1.0, kernel_sigmas))


def _rms_ratio2(estimate: PoseEstimate) -> float:
    return max((estimate.rms_mm / estimate.expected_rms_mm) ** 2, _LEAST_RATIO2)
