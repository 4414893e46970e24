"""Compiled weights and steps: what one iteration does with its pairs.

Source: the correntropy criterion J = 1/N sum exp(-rho_i^2 / 2 sigma^2) (the paper, proposed
equations 7 to 9 as corrected in docs/registration.md), maximised in half-quadratic form: the best
weights for a pose are w_i = exp(-rho_i^2 / 2 sigma^2), the best pose for weights is least squares.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.registration.lookup_kernels import ModelArrays
from navapp.registration.pairing_kernels import Pairs

# Smallest over largest eigenvalue of the information below which a direction counts as free.
# One-sided views of bones have more (docs/registration.md), balls and cylinders next to nothing.
FREE_SHARE = 5e-3
# Squared distance in widths beyond which a kernel is nothing.
_FARTHEST2 = 50.0
_LARGEST_TURN_RAD = 0.25
_LARGEST_SHIFT_MM = 10.0
_SMALLEST_MM = 1e-6


class Weighed(NamedTuple):
    """Sums over weighted pairs: of the kernels (N times J), of kernel x residual^2, x variance."""

    kernels: float
    squares_mm2: float
    variances_mm2: float


@njit(cache=True, nogil=True)
def weigh(pairs: Pairs, n: int, sigma_mm: float, n_sigmas: float, noise_mm2: float) -> Weighed:
    """Correntropy weights of the first n pairs, divided by each pair's variance.

    Args:
        pairs: `weight` in place.
        n: how many.
        sigma_mm: width of the kernel; a pair's is never narrower than `n_sigmas` of its own noise.
        n_sigmas: see above.
        noise_mm2: variance that the points do not know of themselves.
    """
    total, squares, variances = 0.0, 0.0, 0.0
    for i in range(n):
        variance = pairs.variance[i] + noise_mm2
        rho2 = pairs.residual[i] ** 2 + pairs.excess[i] ** 2
        width2 = max(sigma_mm * sigma_mm, n_sigmas * n_sigmas * variance)
        kernel = np.exp(-0.5 * rho2 / width2) if rho2 < _FARTHEST2 * width2 else 0.0
        pairs.weight[i] = kernel / variance
        total += kernel
        squares += kernel * pairs.residual[i] ** 2
        variances += kernel * variance
    return Weighed(total, squares, variances)


@njit(cache=True, nogil=True)
def noise_under_kernel_mm2(squares_mm2: float, kernels: float, sigma_mm: float) -> float:
    """Variance of Gaussian residuals from those that a kernel of width sigma lets through.

    Under the kernel it is v = s^2 sigma^2 / (s^2 + sigma^2); solved for s^2, at most sigma^2:
    residuals as wide as the kernel are no noise that it can tell.
    """
    v = squares_mm2 / max(kernels, 1e-300)
    wide = sigma_mm * sigma_mm
    return min(v * wide / max(wide - v, 1e-300), wide)


@njit(cache=True, nogil=True)
def twist_row(
    pairs: Pairs, i: int, centre: NDArray[np.float64], lever_mm: float, row: NDArray[np.float64]
) -> None:
    """How one residual grows with the motion; `row` is (6,) in place, else as `plane_system`."""
    x, y, z = (
        pairs.point[i, 0] - centre[0],
        pairs.point[i, 1] - centre[1],
        pairs.point[i, 2] - centre[2],
    )
    nx, ny, nz = pairs.direction[i, 0], pairs.direction[i, 1], pairs.direction[i, 2]
    row[0] = (y * nz - z * ny) / lever_mm
    row[1] = (z * nx - x * nz) / lever_mm
    row[2] = (x * ny - y * nx) / lever_mm
    row[3], row[4], row[5] = nx, ny, nz


@njit(cache=True, nogil=True)
def plane_system(
    pairs: Pairs, n: int, centre: NDArray[np.float64], lever_mm: float, H: NDArray[np.float64],
    g: NDArray[np.float64],
) -> None:  # fmt: skip
    """Normal equations of the weighted residuals for a motion of the points.

    Args:
        pairs: weighted; first n hold.
        n: how many.
        centre: (3,) of the rotation, bone coordinates.
        lever_mm: makes rotations and translations comparable: unknowns are (rotation x lever,
            translation), all in mm.
        H: (6, 6) in place.
        g: (6,) in place.
    """
    H[:] = 0.0
    g[:] = 0.0
    row = np.empty(6)
    for i in range(n):
        w = pairs.weight[i]
        twist_row(pairs, i, centre, lever_mm, row)
        for a in range(6):
            scaled = w * row[a]
            g[a] += scaled * pairs.residual[i]
            for b in range(a, 6):
                H[a, b] += scaled * row[b]
    for a in range(6):
        for b in range(a):
            H[a, b] = H[b, a]


class SizeTerms(NamedTuple):
    """What a seventh unknown, the size, adds to the normal equations beside its mixed terms."""

    squares: float
    product_mm: float


@njit(cache=True, nogil=True)
def size_terms(
    pairs: Pairs, n: int, centre: NDArray[np.float64], lever_mm: float, mixed: NDArray[np.float64]
) -> SizeTerms:
    """Terms of a growth of the model about a centre, in mm at the distance of the lever.

    Arguments as of `plane_system`; `mixed` is (6,) in place, with the six unknowns of the motion.
    """
    mixed[:] = 0.0
    squares, product = 0.0, 0.0
    row = np.empty(6)
    for i in range(n):
        w = pairs.weight[i]
        twist_row(pairs, i, centre, lever_mm, row)
        outward = 0.0
        for k in range(3):
            outward += (pairs.point[i, k] - centre[k]) * pairs.direction[i, k]
        outward /= lever_mm
        scaled = w * outward
        squares += scaled * outward
        product += scaled * pairs.residual[i]
        for k in range(6):
            mixed[k] += scaled * row[k]
    return SizeTerms(squares, product)


@njit(cache=True, nogil=True)
def add_point_system(
    pairs: Pairs, n: int, model: ModelArrays, share: float, centre: NDArray[np.float64],
    lever_mm: float, H: NDArray[np.float64], g: NDArray[np.float64],
) -> None:  # fmt: skip
    """Add the distances of the points from their vertices, weighted by a share, to both.

    From far, planes alone let the bone slide along itself; the whole distance holds it back.
    Arguments as of `plane_system`; `share` is what the whole distance weighs beside the plane's.
    """
    for i in range(n):
        w = pairs.weight[i] * share
        v = pairs.vertex[i]
        x = (pairs.point[i, 0] - centre[0]) / lever_mm
        y = (pairs.point[i, 1] - centre[1]) / lever_mm
        z = (pairs.point[i, 2] - centre[2]) / lever_mm
        dx = pairs.point[i, 0] - model.points[v, 0]
        dy = pairs.point[i, 1] - model.points[v, 1]
        dz = pairs.point[i, 2] - model.points[v, 2]
        g[0] += w * (y * dz - z * dy)
        g[1] += w * (z * dx - x * dz)
        g[2] += w * (x * dy - y * dx)
        g[3] += w * dx
        g[4] += w * dy
        g[5] += w * dz
        # J^T J of the three rows [-[p]x | I], p in levers.
        H[0, 0] += w * (y * y + z * z)
        H[1, 1] += w * (x * x + z * z)
        H[2, 2] += w * (x * x + y * y)
        H[0, 1] -= w * x * y
        H[0, 2] -= w * x * z
        H[1, 2] -= w * y * z
        H[0, 4] -= w * z
        H[0, 5] += w * y
        H[1, 3] += w * z
        H[1, 5] -= w * x
        H[2, 3] -= w * y
        H[2, 4] += w * x
        for a in range(3, 6):
            H[a, a] += w
    for a in range(6):
        for b in range(a):
            H[a, b] = H[b, a]


@njit(cache=True, nogil=True)
def weighted_centre(pairs: Pairs, n: int, centre: NDArray[np.float64]) -> float:
    """Weighted mean of the points into `centre`; the rms distance from it, never 0."""
    centre[:] = 0.0
    total = 0.0
    for i in range(n):
        total += pairs.weight[i]
        for k in range(3):
            centre[k] += pairs.weight[i] * pairs.point[i, k]
    if total <= 0.0:
        return _SMALLEST_MM
    centre /= total
    squares = 0.0
    for i in range(n):
        for k in range(3):
            squares += pairs.weight[i] * (pairs.point[i, k] - centre[k]) ** 2
    return max(float(np.sqrt(squares / total)), _SMALLEST_MM)


@njit(cache=True, nogil=True)
def plane_step(
    H: NDArray[np.float64], g: NDArray[np.float64], lever_mm: float, twist: NDArray[np.float64]
) -> None:
    """Gauss-Newton step into `twist`: rotation rad first, then translation mm, both capped.

    A direction that nothing fixes stays where it is: noise would move it without end.
    """
    values, vectors = np.linalg.eigh(H)
    step = np.zeros(6)
    for k in range(6):
        if values[k] > FREE_SHARE * values[5]:
            along = vectors[:, k].copy()
            step += (along @ g) / values[k] * along
    turn = float(np.linalg.norm(step[:3])) / lever_mm
    shift = float(np.linalg.norm(step[3:]))
    less_turn = min(1.0, _LARGEST_TURN_RAD / max(turn, 1e-300))
    less_shift = min(1.0, _LARGEST_SHIFT_MM / max(shift, 1e-300))
    twist[:3] = -step[:3] / lever_mm * less_turn
    twist[3:] = -step[3:] * less_shift


@njit(cache=True, nogil=True)
def apply_twist(
    twist: NDArray[np.float64],
    centre: NDArray[np.float64],
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
) -> None:
    """Move a pose (bone from scene) by a rotation about `centre`, then a translation; in place."""
    x, y, z = twist[0], twist[1], twist[2]
    angle = np.sqrt(x * x + y * y + z * z)
    first = 1.0 - angle * angle / 6.0 if angle < 1e-6 else np.sin(angle) / angle
    second = 0.5 if angle < 1e-6 else (1.0 - np.cos(angle)) / (angle * angle)
    turn = np.empty((3, 3))
    turn[0, 0], turn[0, 1], turn[0, 2] = (
        1.0 - second * (y * y + z * z), second * x * y - first * z, second * x * z + first * y,
    )  # fmt: skip
    turn[1, 0], turn[1, 1], turn[1, 2] = (
        second * x * y + first * z, 1.0 - second * (x * x + z * z), second * y * z - first * x,
    )  # fmt: skip
    turn[2, 0], turn[2, 1], turn[2, 2] = (
        second * x * z - first * y, second * y * z + first * x, 1.0 - second * (x * x + y * y),
    )  # fmt: skip
    rotation[:] = turn @ rotation
    translation[:] = turn @ (translation - centre) + centre + twist[3:]
