"""Readable counterpart of navapp.geometry.zbuffer_kernels: loops, straight from the equations."""

import numpy as np


def nearest(pixels, depths_mm, faces, width, height):
    """(inverse depth, face) per pixel; every pixel centre against every triangle.

    A pixel p lies in a triangle abc when p = wa a + wb b + wc c with weights that sum to 1 and are
    not negative; 1/z is linear in the picture, so 1/z = wa/za + wb/zb + wc/zc.
    """
    inverse_depth = np.zeros((height, width))
    face_index = np.full((height, width), -1)
    for index, face in enumerate(faces):
        corners, z = pixels[face], depths_mm[face]
        if not np.isfinite(corners).all() or (z <= 1e-6).any():
            continue
        system = np.vstack([corners.T, np.ones(3)])
        if abs(np.linalg.det(system)) < 1e-12:
            continue
        to_weights = np.linalg.inv(system)
        for row in range(height):
            for column in range(width):
                weights = to_weights @ (column, row, 1.0)
                value = float((weights / z).sum())
                if (weights >= 0.0).all() and value > inverse_depth[row, column]:
                    inverse_depth[row, column] = value
                    face_index[row, column] = index
    return inverse_depth, face_index
