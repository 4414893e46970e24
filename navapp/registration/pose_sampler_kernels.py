"""Compiled score of poses by a map of measured depth: what agrees, less what is seen through."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.registration.initial_kernels import Optics

# Seen under a flatter angle, a point's depth hangs on fractions of a pixel.
LEAST_COSINE = 0.2
# Seen through: further away than so many widths of the kernel; fully so by this much more.
BEHIND_WIDTHS = 2.0
FULLY_BEHIND_MM = 1.0
BEHIND_WEIGHT = 2.0


class SurfacePoints(NamedTuple):
    """Points of a model, N of them.

    Attributes:
        points: (N, 3) mm.
        normals: (N, 3) unit, outward.
        variance: (N,) mm2 along the normal.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    variance: NDArray[np.float64]


@njit(cache=True, nogil=True)
def score_poses(
    surface: SurfacePoints,
    n_first: int,
    rotations: NDArray[np.float64],
    shifts: NDArray[np.float64],
    depth: NDArray[np.float32],
    optics: Optics,
    sigma_mm: float,
    span: tuple[int, int],
    score: NDArray[np.float64],
) -> None:
    """Share of a model's seen area that was measured there, less the share that was seen through.

    The kernel is the fit's own; a point that something nearer hides, or where nothing was measured,
    counts for nothing.

    Args:
        surface: the model's.
        n_first: so many of its points are asked.
        rotations: (H, 3, 3) of the poses.
        shifts: (H, 3) mm.
        depth: (h, w) measured, mm; 0 where unknown.
        optics: of that map.
        sigma_mm: width of the kernel, along the normal.
        span: first and last (exclusive) pose to be done.
        score: (H,) in place, -1 to 1.
    """
    height, width = depth.shape
    for k in range(span[0], span[1]):
        R, t = rotations[k], shifts[k]
        area, agreeing, behind = 0.0, 0.0, 0.0
        for i in range(min(n_first, len(surface.points))):
            p, n = surface.points[i], surface.normals[i]
            x = R[0, 0] * p[0] + R[0, 1] * p[1] + R[0, 2] * p[2] + t[0]
            y = R[1, 0] * p[0] + R[1, 1] * p[1] + R[1, 2] * p[2] + t[1]
            z = R[2, 0] * p[0] + R[2, 1] * p[1] + R[2, 2] * p[2] + t[2]
            facing = (
                -x * (R[0, 0] * n[0] + R[0, 1] * n[1] + R[0, 2] * n[2])
                - y * (R[1, 0] * n[0] + R[1, 1] * n[1] + R[1, 2] * n[2])
                - z * (R[2, 0] * n[0] + R[2, 1] * n[1] + R[2, 2] * n[2])
            )
            if z <= 1e-6 or facing <= 0.0:
                continue
            cosine = facing / np.sqrt(x * x + y * y + z * z)
            if cosine < LEAST_COSINE:
                continue
            area += cosine
            u = int(np.floor(optics.focal * x / z + optics.centre_x + 0.5))
            v = int(np.floor(optics.focal * y / z + optics.centre_y + 0.5))
            if not (0 <= u < width and 0 <= v < height) or depth[v, u] <= 0.0:
                continue
            off_mm = (depth[v, u] - z) * cosine
            kernel_mm2 = sigma_mm * sigma_mm + surface.variance[i]
            agreeing += cosine * np.exp(-0.5 * off_mm * off_mm / kernel_mm2)
            too_far_mm = off_mm - BEHIND_WIDTHS * np.sqrt(kernel_mm2)
            if too_far_mm > 0.0:
                behind += cosine * min(too_far_mm / FULLY_BEHIND_MM, 1.0)
        score[k] = (agreeing - BEHIND_WEIGHT * behind) / area if area > 0.0 else -1.0
