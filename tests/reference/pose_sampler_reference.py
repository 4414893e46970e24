"""Readable version of the compiled score of poses by measured depth."""

import numpy as np


def score(rotation, shift, surface, depth, optics, sigma_mm):
    """Area on the measured surface, less twice what is seen through, over the area seen."""
    points = surface.points_mm @ rotation.T + shift
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    cosine = -np.sum((surface.normals @ rotation.T) * rays, axis=1)
    is_seen = cosine >= 0.2
    points, cosine, variance = points[is_seen], cosine[is_seen], surface.variance_mm2[is_seen]
    total = 0.0
    for (x, y, z), weight, mm2 in zip(points, cosine, variance, strict=True):
        column = int(np.floor(optics.focal_px * x / z + optics.centre_x_px + 0.5))
        row = int(np.floor(optics.focal_px * y / z + optics.centre_y_px + 0.5))
        is_inside = 0 <= row < depth.shape[0] and 0 <= column < depth.shape[1]
        if is_inside and depth[row, column] > 0:
            off = (depth[row, column] - z) * weight
            width = np.sqrt(sigma_mm**2 + mm2)
            total += weight * np.exp(-0.5 * (off / width) ** 2)
            total -= 2.0 * weight * np.clip(off - 2.0 * width, 0.0, 1.0)
    return total / cosine.sum()
