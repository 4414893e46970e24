"""Compiled weights and steps: what one iteration does with its pairs.

Source: the correntropy criterion J = 1/N sum exp(-rho_i^2 / 2 sigma^2) (the paper, proposed
equations 7 to 9 as corrected in docs/how/registration.md), maximised in half-quadratic form: the
best weights for a pose are w_i = exp(-rho_i^2 / 2 sigma^2), the best pose for weights is least
squares.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from navapp.geometry.transform import FloatArray
from navapp.registration.lookup_kernels import ModelArrays
from navapp.registration.pairing_kernels import Pairs, Pose

# Smallest over largest eigenvalue of the information below which a direction counts as free.
# One-sided views of bones have 0.03 and more (`python -m tests.bench.registration`), balls and
# cylinders next to nothing.
FREE_FRACTION = 5e-3
# All chosen. Squared distance in widths beyond which a kernel is nothing; the largest step; the
# shortest lever.
_FARTHEST2 = 50.0
_LARGEST_TURN_RAD, _LARGEST_SHIFT_MM = 0.25, 10.0
_SHORTEST_MM = 1e-6


class Weighed(NamedTuple):
    """Sums over weighted pairs: of the kernels (N times J), of kernel x residual^2, x variance."""

    kernels: float
    squares_mm2: float
    variances_mm2: float


@njit(cache=True, nogil=True)
def weigh(pairs: Pairs, n: int, sigma_mm: float, n_sigmas: float, noise_mm2: float) -> Weighed:
    """Correntropy weights of the first n pairs, divided by each pair's variance; in place.

    A pair's kernel is never narrower than `n_sigmas` of its own noise. `noise_mm2` is variance that
    the points do not know of themselves.
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
def find_weighted_centre(pairs: Pairs, n: int) -> tuple[FloatArray, float]:
    """(3,) weighted mean of the points, and the rms distance from it, never 0."""
    centre = np.zeros(3)
    total = 0.0
    for i in range(n):
        total += pairs.weight[i]
        for k in range(3):
            centre[k] += pairs.weight[i] * pairs.point[i, k]
    if total <= 0.0:
        return centre, _SHORTEST_MM
    centre /= total
    squares = 0.0
    for i in range(n):
        for k in range(3):
            squares += pairs.weight[i] * (pairs.point[i, k] - centre[k]) ** 2
    return centre, max(float(np.sqrt(squares / total)), _SHORTEST_MM)


@njit(cache=True, nogil=True)
def set_motion_row(
    pairs: Pairs, i: int, centre: FloatArray, lever_mm: float, row: FloatArray
) -> None:
    """How one residual grows with the motion; `row` is (6,) in place."""
    x = pairs.point[i, 0] - centre[0]
    y = pairs.point[i, 1] - centre[1]
    z = pairs.point[i, 2] - centre[2]
    nx, ny, nz = pairs.direction[i, 0], pairs.direction[i, 1], pairs.direction[i, 2]
    row[0] = (y * nz - z * ny) / lever_mm
    row[1] = (z * nx - x * nz) / lever_mm
    row[2] = (x * ny - y * nx) / lever_mm
    row[3], row[4], row[5] = nx, ny, nz


@njit(cache=True, nogil=True)
def find_motion_rows(pairs: Pairs, n: int, centre: FloatArray, lever_mm: float) -> FloatArray:
    """(n, 6) how the first n residuals grow with the motion."""
    rows = np.empty((n, 6))
    for i in range(n):
        set_motion_row(pairs, i, centre, lever_mm, rows[i])
    return rows


@njit(cache=True, nogil=True)
def mirror(H: FloatArray) -> None:
    """Copy the upper triangle into the lower one, in place."""
    for a in range(len(H)):
        for b in range(a):
            H[a, b] = H[b, a]


@njit(cache=True, nogil=True)
def sum_plane_system(
    pairs: Pairs, n: int, centre: FloatArray, lever_mm: float
) -> tuple[FloatArray, FloatArray]:
    """Normal equations H (6, 6), g (6,) of the weighted residuals for a motion of the points.

    Unknowns are (rotation about the centre x lever, translation), all in mm: the lever makes them
    comparable.
    """
    H, g, row = np.zeros((6, 6)), np.zeros(6), np.empty(6)
    for i in range(n):
        w = pairs.weight[i]
        set_motion_row(pairs, i, centre, lever_mm, row)
        for a in range(6):
            scaled = w * row[a]
            g[a] += scaled * pairs.residual[i]
            for b in range(a, 6):
                H[a, b] += scaled * row[b]
    mirror(H)
    return H, g


@njit(cache=True, nogil=True)
def sum_size_terms(
    pairs: Pairs, n: int, centre: FloatArray, lever_mm: float
) -> tuple[FloatArray, float, float]:
    """What a seventh unknown adds to the plane system: growth about the centre, mm at the lever.

    Its (6,) mixed terms with the motion, its own squares, and its product with the residuals.
    """
    mixed, row = np.zeros(6), np.empty(6)
    squares, product_mm = 0.0, 0.0
    for i in range(n):
        w = pairs.weight[i]
        set_motion_row(pairs, i, centre, lever_mm, row)
        outward = 0.0
        for k in range(3):
            outward += (pairs.point[i, k] - centre[k]) * pairs.direction[i, k]
        outward /= lever_mm
        scaled = w * outward
        squares += scaled * outward
        product_mm += scaled * pairs.residual[i]
        for k in range(6):
            mixed[k] += scaled * row[k]
    return mixed, squares, product_mm


@njit(cache=True, nogil=True)
def add_point_system(
    pairs: Pairs, n: int, model: ModelArrays, point_weight: float, centre: FloatArray,
    lever_mm: float, H: FloatArray, g: FloatArray,
) -> None:  # fmt: skip
    """Add the points' whole distances from their vertices to the plane system, in place.

    While far, planes alone let the bone slide along itself; the whole distance holds it back.
    `point_weight` is what it weighs beside the plane's.
    """
    for i in range(n):
        w = pairs.weight[i] * point_weight
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
    mirror(H)


@njit(cache=True, nogil=True)
def solve_step(H: FloatArray, g: FloatArray, lever_mm: float) -> FloatArray:
    """(6,) Gauss-Newton step: rotation rad first, then translation mm, both capped.

    A direction that nothing fixes stays where it is: noise would move it without end.
    """
    values, vectors = np.linalg.eigh(H)
    step = np.zeros(6)
    for k in range(6):
        if values[k] > FREE_FRACTION * values[5]:
            along = vectors[:, k].copy()
            step += (along @ g) / values[k] * along
    turn = float(np.linalg.norm(step[:3])) / lever_mm
    shift = float(np.linalg.norm(step[3:]))
    twist = np.empty(6)
    twist[:3] = -step[:3] / lever_mm * min(1.0, _LARGEST_TURN_RAD / max(turn, 1e-300))
    twist[3:] = -step[3:] * min(1.0, _LARGEST_SHIFT_MM / max(shift, 1e-300))
    return twist


@njit(cache=True, nogil=True)
def apply_twist(twist: FloatArray, centre: FloatArray, pose: Pose) -> None:
    """Move a pose (bone from scene) by a rotation about `centre`, then a translation; in place."""
    x, y, z = twist[0], twist[1], twist[2]
    angle = np.sqrt(x * x + y * y + z * z)
    # Rodrigues' formula: I + a [w]x + b [w]x^2.
    a = 1.0 - angle * angle / 6.0 if angle < 1e-6 else np.sin(angle) / angle
    b = 0.5 if angle < 1e-6 else (1.0 - np.cos(angle)) / (angle * angle)
    turn = np.array(
        [
            [1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y],
            [b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x],
            [b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)],
        ]
    )
    pose.rotation[:] = turn @ pose.rotation
    pose.translation[:] = turn @ (pose.translation - centre) + centre + twist[3:]


@njit(cache=True, nogil=True)
def make_step(
    pairs: Pairs, n: int, model: ModelArrays, point_weight: float, pose: Pose
) -> tuple[float, float, float]:
    """Move the pose by one step of the weighted pairs; its angle, its length, and the lever."""
    centre, lever_mm = find_weighted_centre(pairs, n)
    H, g = sum_plane_system(pairs, n, centre, lever_mm)
    if point_weight > 0.0:
        add_point_system(pairs, n, model, point_weight, centre, lever_mm, H, g)
    twist = solve_step(H, g, lever_mm)
    apply_twist(twist, centre, pose)
    return float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:])), lever_mm
