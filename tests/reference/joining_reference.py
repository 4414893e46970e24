"""Surface and a further block joined, in matrices."""

import numpy as np

from navapp.registration.joining_kernels import FurtherBlock, Joined, SurfaceBlock

KERNEL_SIGMAS, ROUNDS, CLAIM_COUNT = 2.5, 6, 6.0


def solve_joined(surface: SurfaceBlock, block: FurtherBlock, start: np.ndarray) -> Joined:
    """As the kernel: iteratively reweighted least squares with one unknown more for the offset."""
    k = len(start)
    rows = np.column_stack([block.rows, np.ones(len(block.rows))])
    known, offset = np.zeros((k + 1, k + 1)), np.zeros((k + 1, k + 1))
    known[:k, :k], offset[k, k] = np.linalg.inv(surface.covariance), 1.0 / block.common_sd**2
    expected, step = np.append(surface.step, 0.0), np.append(start, 0.0)

    def weigh(step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        misfit2 = (block.residual - rows @ step) ** 2 / block.variance
        return misfit2, np.exp(-0.5 * misfit2 / KERNEL_SIGMAS**2)

    for _ in range(ROUNDS):
        misfit2, kernel = weigh(step)
        count = kernel / block.n_sharing
        n, squares = count.sum(), (count * misfit2).sum()
        # Noise that the kernel lets through: v = s^2 w^2 / (s^2 + w^2), solved for s^2.
        v, wide = squares / n, KERNEL_SIGMAS**2
        scale = (CLAIM_COUNT + n * min(v * wide / (wide - v), wide)) / (CLAIM_COUNT + n)
        weighted = rows.T * (count / block.variance)
        information = weighted @ rows
        normal = known / surface.scale + offset + information / scale
        both = known @ expected / surface.scale + weighted @ block.residual / scale
        step = np.linalg.solve(normal, both)
    inverse = np.linalg.inv(normal)
    noise = surface.noise_variance_ratio * known / surface.scale**2 + offset
    noise += information * max(scale, 1.0) / scale**2
    lost = KERNEL_SIGMAS**2 * (1.0 - weigh(step)[1]) / block.n_sharing
    apart = step - expected
    cost = 0.5 * apart @ (known / surface.scale + offset) @ apart + lost.sum()
    return Joined(step[:k], (inverse @ noise @ inverse)[:k, :k], float(cost))
