"""Output files of `navapp stereo`: a picture of the disparity, and the point cloud."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedGeometry
from navapp.values import DisparityMap, Origin

_ALL = (Origin.MATCHED, Origin.FILLED_BORDER, Origin.FILLED_INTERIOR, Origin.MISMATCH_FILLED)
_HATCH_PX = 6


def draw_disparity(disparity_map: DisparityMap) -> NDArray[np.uint8]:
    """(h, w, 3) BGR: near is warm, far is cold, unknown black; filled pixels are hatched."""
    import cv2

    disparity = disparity_map.disparity_px
    known = np.isfinite(disparity)
    if not known.any():
        return np.zeros((*disparity.shape, 3), dtype=np.uint8)
    low, high = np.percentile(disparity[known], [1.0, 99.0])
    scaled = np.nan_to_num((disparity - low) / max(high - low, 1e-6))
    grey = np.clip(255.0 * scaled, 0.0, 255.0).astype(np.uint8)
    picture = np.array(cv2.applyColorMap(grey, cv2.COLORMAP_TURBO), dtype=np.uint8)
    rows, columns = np.indices(disparity.shape)
    is_filled = known & (disparity_map.origin != Origin.MATCHED)
    # Border to the one side, interior to the other: as the directions of the fill.
    leans_left = (rows + columns) % _HATCH_PX < 2
    leans_right = (rows - columns) % _HATCH_PX < 2
    is_border = disparity_map.origin == Origin.FILLED_BORDER
    picture[is_filled & np.where(is_border, leans_left, leans_right)] //= 3
    picture[~known] = 0
    return picture


def make_cloud_ply(disparity_map: DisparityMap, geometry: RectifiedGeometry) -> bytes:
    """Binary PLY: points in the unrectified left camera, mm, with sigma on the ray and origin."""
    cloud = disparity_map.reproject(geometry, origins=_ALL)
    points = geometry.rectified_from_left.inverse().apply(cloud.points_mm)
    table = np.empty(
        len(cloud),
        dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("sigma_mm", "<f4"), ("origin", "u1")],
    )
    table["x"], table["y"], table["z"] = points.T
    table["sigma_mm"] = cloud.sigma_ray_mm
    table["origin"] = cloud.origin
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        "comment SPACE=left camera\ncomment UNIT=mm\n"
        f"element vertex {len(table)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property float sigma_mm\nproperty uchar origin\nend_header\n"
    )
    return header.encode("ascii") + table.tobytes()
