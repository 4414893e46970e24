"""Another kind of residuals joined with a fit to a surface: where both agree, and in which size."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.registration.information import leaves_direction_free
from navapp.registration.joining_kernels import FurtherBlock, SurfaceBlock, solve_joined
from navapp.registration.step_kernels import noise_under_kernel_mm2
from navapp.values import PoseEstimate, Reason, SizedPose

# All chosen, but where a source is named.
# A residual further off than this, in sigma of itself and of the pose, belongs to something else.
_GATE_SIGMAS = 3.0
# Chi-square of 6 degrees of freedom at 95 %: blocks that pull further apart are not joined.
_APART = 12.59
# Those residuals of a wrong pose that happen to be small agree with it: they must not speak for the
# others. Of right ones most are near (`python -m tests.bench.outline`), fewer where tissue covers
# the rim.
_MOST_FAR, _BY_CHANCE = 0.5, 1.0
_FEWEST = 6.0
# Residuals that show nothing at all (drawn data) still leave a scale.
_LEAST_SQUARED_RATIO = 1e-4


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
    arm_mm: FloatArray  # (N, 3) from the model's centre to the points that they belong to

    def sized_jacobian(self, sized: SizedPose) -> FloatArray:
        """(N, 7) `jacobian`, and a column for the growth of the model."""
        grown_mm = (self.arm_mm + sized.arm_mm) / sized.lever_mm
        return np.column_stack([self.jacobian, (self.jacobian[:, :3] * grown_mm).sum(axis=1)])

    def find_near(
        self, rows: FloatArray, step: FloatArray, covariance: FloatArray
    ) -> "NearResiduals":
        """Those residuals that the k unknowns of a pose allow, to be joined.

        Args:
            rows: (N, k) how the predictions grow with the unknowns.
            step: (k,) the unknowns.
            covariance: (k, k) of them.
        """
        by_unknowns = ((rows @ covariance) * rows).sum(axis=1)
        expected = self.variance + by_unknowns + self.common_sd**2
        is_near = (self.residual - rows @ step) ** 2 < _GATE_SIGMAS**2 * expected
        block = FurtherBlock(
            rows[is_near], self.residual[is_near], self.variance[is_near], self.n_sharing[is_near],
            self.common_sd,
        )  # fmt: skip
        count = 1.0 / self.n_sharing
        return NearResiduals(block, float(count.sum()), float(count[is_near].sum()))


class NearResiduals(NamedTuple):
    """Those of a block's residuals that a pose allows."""

    block: FurtherBlock
    # of residuals with errors of their own: all, and those that are near.
    n_all: float
    n_near: float

    @property
    def is_few(self) -> bool:
        """Whether they are too few to say anything."""
        return self.n_near < _FEWEST

    @property
    def is_other(self) -> bool:
        """Whether too many are far off: the block is of something else than the model there."""
        n_far = self.n_all - self.n_near
        return self.n_all >= _FEWEST and n_far > _MOST_FAR * self.n_all + _BY_CHANCE


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

    That pose is one of the model in its own size. Pose and size fitted together are told beside it
    (`PoseEstimate.sized`), also where the block does not move the pose.

    Source: Gauss-Newton on the sum of squares, kernel weights as in `step_kernels.weigh`; variance
    components after Foerstner 1979; covariance of an estimator with other weights than its noise's.
    """
    # What the surface's residuals show of the variance that they claim, at most all of it. Where
    # thickness was fitted, most of the covariance is the plan's, of which they show nothing.
    ratio2 = max((estimate.rms_mm / estimate.expected_rms_mm) ** 2, _LEAST_SQUARED_RATIO)
    scale = min(float(noise_under_kernel_mm2(ratio2, 1.0, kernel_sigmas)), 1.0)
    if estimate.thickness_ratio is not None:
        scale = 1.0
    # Of one memory layout: for each there would be a compiled version.
    covariance = np.ascontiguousarray(estimate.covariance)
    surface = SurfaceBlock(np.zeros(6), covariance, scale, noise_variance_ratio)
    near = block.find_near(block.jacobian, surface.step, surface.covariance)
    joined = None
    if not (near.is_other or near.is_few):
        joined = solve_joined(surface, near.block, surface.step)
        if joined.step @ np.linalg.solve(estimate.covariance, joined.step) > _APART:
            joined = None
    step = surface.step if joined is None else joined.step
    sized = None if estimate.sized is None else _join_size(estimate.sized, surface, block, step)
    if joined is None:
        alone = replace(estimate.scale_noise(noise_variance_ratio), sized=sized)
        return alone.with_reason(Reason.CUES_DISAGREE) if near.is_other else alone
    covariance = joined.covariance
    pose = estimate.camera_from_bone.move(step, centre_mm)
    sized, reasons = None if sized is None else sized.seen_from(step), estimate.reasons
    if Reason.DEGENERATE in reasons and not leaves_direction_free(covariance, centre_mm, seen_mm):
        reasons = tuple(reason for reason in reasons if reason is not Reason.DEGENERATE)
    return replace(
        estimate, camera_from_bone=pose, covariance=covariance, reasons=reasons, sized=sized
    )


def _join_size(
    sized: SizedPose, of_pose: SurfaceBlock, block: ResidualBlock, pose_step: FloatArray
) -> SizedPose:
    """The pose in another size on which both agree; the surface's where the block says little.

    A surface that is wrong about the size leaves most of a rim beyond the kernel. So it is looked
    for from the size that the surface tells, and from the model's own at the pose (6,) that both
    gave it: the better of the two minima counts.
    """
    covariance = np.ascontiguousarray(sized.covariance)
    surface = of_pose._replace(step=sized.step, covariance=covariance)
    rows = block.sized_jacobian(sized)
    near = block.find_near(rows, surface.step, surface.covariance)
    if near.is_few or near.is_other:
        return sized.scale_noise(surface.noise_variance_ratio)
    starts = surface.step, np.append(pose_step, 0.0)
    found = (solve_joined(surface, near.block, start) for start in starts)
    best = min(found, key=lambda one: one.cost)
    return replace(sized, step=best.step, covariance=best.covariance)
