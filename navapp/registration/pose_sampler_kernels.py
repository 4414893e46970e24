"""Compiled score of poses by a map of measured depth: what agrees, less what is seen through."""

from typing import NamedTuple

import numpy as np
from numba import njit

from navapp.geometry.transform import FloatArray
from navapp.registration.depth_map import DepthMap
from navapp.registration.initial_kernels import rotate

# The score's formula is in docs/how/registration.md, "A bone that is partly buried". All chosen.
# Seen under a flatter angle, a point's depth hangs on fractions of a pixel.
LEAST_COSINE = 0.2
# Seen through: further away than so many widths of the kernel; fully so by this much more.
BEHIND_WIDTHS = 2.0
FULLY_BEHIND_MM = 1.0
BEHIND_WEIGHT = 2.0


class SurfacePoints(NamedTuple):
    """Points of a model."""

    points_mm: FloatArray  # (N, 3)
    normals: FloatArray  # (N, 3) unit, outward
    variance_mm2: FloatArray  # (N,) along the normal


@njit(cache=True, nogil=True)
def score_poses(
    surface: SurfacePoints,
    n_first: int,
    rotations: FloatArray,
    shifts_mm: FloatArray,
    depth: DepthMap,
    sigma_mm: float,
    score: FloatArray,
    span: tuple[int, int],
) -> None:
    """Fraction of a model's seen area that was measured there, less what was seen through.

    The kernel is the fit's own; a point that something nearer hides, or where nothing was measured,
    counts for nothing.

    Args:
        surface: the model's.
        n_first: so many of its points count.
        rotations: (H, 3, 3) of the poses.
        shifts_mm: (H, 3).
        depth: measured.
        sigma_mm: width of the kernel, along the normal.
        score: (H,) in place, -2 to 1.
        span: first and last (exclusive) pose to be done.
    """
    depth_mm, optics = depth.depth_mm, depth.optics
    height, width = depth_mm.shape
    for k in range(span[0], span[1]):
        R, t = rotations[k], shifts_mm[k]
        area, agreeing, behind = 0.0, 0.0, 0.0
        for i in range(min(n_first, len(surface.points_mm))):
            x, y, z = rotate(R, surface.points_mm, i)
            x, y, z = x + t[0], y + t[1], z + t[2]
            normal_x, normal_y, normal_z = rotate(R, surface.normals, i)
            facing = -x * normal_x - y * normal_y - z * normal_z
            if z <= 1e-6 or facing <= 0.0:
                continue
            cosine = facing / np.sqrt(x * x + y * y + z * z)
            if cosine < LEAST_COSINE:
                continue
            area += cosine
            u = int(np.floor(optics.focal_px * x / z + optics.centre_x_px + 0.5))
            v = int(np.floor(optics.focal_px * y / z + optics.centre_y_px + 0.5))
            if not (0 <= u < width and 0 <= v < height) or depth_mm[v, u] <= 0.0:
                continue
            off_mm = (depth_mm[v, u] - z) * cosine
            kernel_mm2 = sigma_mm * sigma_mm + surface.variance_mm2[i]
            agreeing += cosine * np.exp(-0.5 * off_mm * off_mm / kernel_mm2)
            too_far_mm = off_mm - BEHIND_WIDTHS * np.sqrt(kernel_mm2)
            if too_far_mm > 0.0:
                behind += cosine * min(too_far_mm / FULLY_BEHIND_MM, 1.0)
        score[k] = (agreeing - BEHIND_WEIGHT * behind) / area if area > 0.0 else -1.0
