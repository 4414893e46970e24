"""Compiled solve for the unknowns on which a surface and a further block of residuals agree."""

from typing import NamedTuple

import numpy as np
from numba import njit

from navapp.geometry.transform import FloatArray
from navapp.registration.step_kernels import mirror, noise_under_kernel_mm2

# All chosen. Width of the kernel in sigma: 97 % of the efficiency of least squares (as
# `BimccSettings`); steps of the search.
_KERNEL_SIGMAS = 2.5
_ROUNDS = 6
# What a block's residuals say of its noise counts beside what it claims, which counts as so many.
_CLAIM_COUNT = 6.0


class SurfaceBlock(NamedTuple):
    """What the surface says of k unknowns."""

    step: FloatArray  # (k,)
    covariance: FloatArray  # (k, k)
    scale: float  # variance of its residuals over the one that they claim
    noise_variance_ratio: float  # variance that its noise has, over the one that it claims


class FurtherBlock(NamedTuple):
    """Residuals that the k unknowns bring down, those that take part: finite, variances above 0."""

    rows: FloatArray  # (N, k) how the predictions grow with the unknowns
    residual: FloatArray  # (N,) observed - predicted
    variance: FloatArray  # (N,)
    n_sharing: FloatArray  # (N,) so many residuals, itself included, share one's error
    common_sd: float  # standard deviation of an offset that all of them have in common


class Joined(NamedTuple):
    """Where surface and block agree."""

    step: FloatArray  # (k,)
    covariance: FloatArray  # (k, k)
    cost: float  # what is minimised: half of the squares of both, those of the block under a kernel


@njit(cache=True, nogil=True)
def solve_joined(surface: SurfaceBlock, block: FurtherBlock, start: FloatArray) -> Joined:
    """The (k,) unknowns on which surface and block agree, searched from a start (k,).

    The offset that the block's residuals have in common is one unknown more.
    """
    k = len(start)
    by_surface, by_offset = np.zeros((k + 1, k + 1)), np.zeros((k + 1, k + 1))
    by_surface[:k, :k] = np.linalg.inv(surface.covariance) / surface.scale
    by_offset[k, k] = 1.0 / block.common_sd**2
    expected, step = np.zeros(k + 1), np.zeros(k + 1)
    expected[:k], step[:k] = surface.step, start
    information, pull = np.empty((k + 1, k + 1)), np.empty(k + 1)
    scale = 1.0
    for _ in range(_ROUNDS):
        scale = sum_block(block, step, information, pull)
        normal = by_surface + by_offset + information / scale
        step = np.linalg.solve(normal, by_surface @ expected + pull / scale)
    inverse = np.linalg.inv(normal)
    # A block that shows more noise than it claims is believed.
    noise = surface.noise_variance_ratio / surface.scale * by_surface + by_offset
    noise += information * (max(scale, 1.0) / scale**2)
    covariance = (inverse @ noise @ inverse)[:k, :k]
    apart = step - expected
    cost = 0.5 * (apart @ ((by_surface + by_offset) @ apart)) + sum_lost(block, step)
    return Joined(step[:k].copy(), 0.5 * (covariance + covariance.T), cost)


@njit(cache=True, nogil=True)
def sum_block(
    block: FurtherBlock, step: FloatArray, information: FloatArray, pull: FloatArray
) -> float:
    """Normal equations of the residuals under the kernel, and variance over the claimed one.

    Args:
        block: of k unknowns.
        step: (k + 1,) unknowns and common offset.
        information: (k + 1, k + 1) in place.
        pull: (k + 1,) in place.

    Returns:
        What the residuals show of their claimed variance, drawn to 1 when they are few.
    """
    size = len(step)
    information[:], pull[:] = 0.0, 0.0
    row = np.ones(size)
    n, squares = 0.0, 0.0
    for i in range(len(block.residual)):
        row[: size - 1] = block.rows[i]
        misfit2, kernel = weigh_one(block, i, step)
        count = kernel / block.n_sharing[i]
        n += count
        squares += count * misfit2
        for a in range(size):
            weighted = count / block.variance[i] * row[a]
            pull[a] += weighted * block.residual[i]
            for b in range(a, size):
                information[a, b] += weighted * row[b]
    mirror(information)
    shown = noise_under_kernel_mm2(squares, n, _KERNEL_SIGMAS)
    return float((_CLAIM_COUNT + n * shown) / (_CLAIM_COUNT + n))


@njit(cache=True, nogil=True)
def weigh_one(block: FurtherBlock, i: int, step: FloatArray) -> tuple[float, float]:
    """Squared misfit of a residual in its variance at (k + 1,) unknowns, and its kernel."""
    left = block.residual[i] - step[-1]
    for a in range(len(step) - 1):
        left -= block.rows[i, a] * step[a]
    misfit2 = left * left / block.variance[i]
    return misfit2, float(np.exp(-0.5 * misfit2 / _KERNEL_SIGMAS**2))


@njit(cache=True, nogil=True)
def sum_lost(block: FurtherBlock, step: FloatArray) -> float:
    """The block's part of the cost at (k + 1,) unknowns."""
    lost = 0.0
    for i in range(len(block.residual)):
        lost += _KERNEL_SIGMAS**2 * (1.0 - weigh_one(block, i, step)[1]) / block.n_sharing[i]
    return lost
