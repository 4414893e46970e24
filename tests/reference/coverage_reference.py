"""Readable counterpart of sim_devices.coverage_kernels."""

import numpy as np


def find_edges(triangle, inverse_depth, part_of_face, material_of_face, focal_px):
    """(H, W) pixels of which one of the eight neighbours shows another surface."""
    h, w = triangle.shape
    surface = np.where(triangle < 0, -1, 256 * material_of_face[triangle].astype(int))
    surface = np.where(triangle < 0, -1, surface + part_of_face[triangle])
    is_edge = np.zeros((h, w), dtype=bool)
    for y in range(h):
        for x in range(w):
            around = slice(max(y - 1, 0), y + 2), slice(max(x - 1, 0), x + 2)
            is_edge[y, x] = (surface[around] != surface[y, x]).any()
            if surface[y, x] >= 0 and not is_edge[y, x]:
                ratio = inverse_depth[y, x] / inverse_depth[around]
                rows, columns = np.mgrid[around]
                distance_px = np.hypot(rows - y, columns - x)
                step = focal_px * (np.maximum(ratio, 1.0 / ratio) - 1.0)
                is_edge[y, x] = (step > 4.0 * distance_px).any()
    return is_edge
