"""Reprojection: disparity to points in mm."""

import numpy as np

from navapp.geometry.rectification import RectifiedGeometry
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
    wanted = np.isin(disparity_map.origin, [int(origin) for origin in origins])
    wanted &= np.isfinite(disparity_map.disparity_px) & (disparity_map.disparity_px > 0.0)
    thinned = np.zeros_like(wanted)
    thinned[::stride_px, ::stride_px] = wanted[::stride_px, ::stride_px]
    rows, columns = np.nonzero(thinned)
    disparity = disparity_map.disparity_px[rows, columns].astype(np.float64)
    sigma_px = disparity_map.sigma_px[rows, columns].astype(np.float64)
    z = geometry.focal_px * geometry.baseline_mm / disparity
    u = columns + disparity_map.x
    v = rows + disparity_map.y
    x = (u - geometry.centre_x_px) / geometry.focal_px
    y = (v - geometry.centre_y_px) / geometry.focal_px
    ray_length = np.sqrt(1.0 + x * x + y * y)
    sigma_z = z * z / (geometry.focal_px * geometry.baseline_mm) * sigma_px
    return SurfaceCloud(
        np.column_stack([x * z, y * z, z]),
        sigma_z * ray_length,
        np.column_stack([u, v]).astype(np.int32),
        disparity_map.origin[rows, columns],
        stride_px,
    )
