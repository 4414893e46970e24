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
                # The nearer of two says how wide a pixel is there, whichever is asked.
                first = np.zeros(ratio.shape, dtype=bool)
                first[: (1 if y > 0 else 0)] = True
                row = 1 if y > 0 else 0
                first[row, : (1 if x > 0 else 0)] = True
                apart = np.where(first, 1.0 / ratio - 1.0, ratio - 1.0)
                is_edge[y, x] = (focal_px * np.abs(apart) > 4.0).any()
    return is_edge
