"""Reprojection: disparity to points in mm."""

import numpy as np

from navapp.geometry.rectification import RectifiedGeometry
from navapp.stereo.surface_kernels import count_wanted, reproject_pixels
from navapp.values import DisparityMap, Origin, SurfaceCloud


def reproject(
    disparity_map: DisparityMap,
    geometry: RectifiedGeometry,
    stride_px: int = 1,
    origins: tuple[Origin, ...] = (Origin.MATCHED,),
) -> SurfaceCloud:
    """Points of the rectified left camera, every `stride_px`-th pixel each way.

    Args:
        disparity_map: of the rectified left view.
        geometry: of the rectified pair.
        stride_px: 1 takes all pixels.
        origins: which pixels; by default the measured ones only.

    Source: z = f B / d; sigma_z = z^2 / (f B) * sigma_d.
    """
    is_wanted = np.zeros(256, dtype=np.bool_)
    is_wanted[[int(origin) for origin in origins]] = True
    found = disparity_map
    fixed = (found.origin, is_wanted, stride_px)
    n = count_wanted(found.disparity_px, *fixed)
    points_mm, sigma_ray_mm = np.empty((n, 3)), np.empty(n)
    pixels, origin = np.empty((n, 2), dtype=np.int32), np.empty(n, dtype=np.uint8)
    camera = (
        geometry.focal_px, geometry.centre_x_px, geometry.centre_y_px, geometry.baseline_mm
    )  # fmt: skip
    reproject_pixels(
        found.disparity_px, found.sigma_px, *fixed, (found.x, found.y), camera, points_mm,
        sigma_ray_mm, pixels, origin,
    )  # fmt: skip
    return SurfaceCloud(points_mm, sigma_ray_mm, pixels, origin, stride_px)
