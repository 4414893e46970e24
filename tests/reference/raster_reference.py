"""Readable counterpart of sim_devices.raster_kernels."""

import numpy as np


def project(points, pose, camera):
    """(V, 3) u, v, 1 / z with OpenCV's own projection."""
    import cv2

    matrix = np.array([[camera[0], 0, camera[2]], [0, camera[1], camera[3]], [0, 0, 1]])
    rotation, _ = cv2.Rodrigues(pose[:, :3].copy())
    pixels, _ = cv2.projectPoints(
        points.reshape(-1, 1, 3), rotation, pose[:, 3].copy(), matrix, camera[4:].reshape(1, -1)
    )
    z = points @ pose[2, :3] + pose[2, 3]
    return np.column_stack([pixels.reshape(-1, 2), 1.0 / z])


def raster(screen, faces, width, height):
    """(inverse depth, triangle), every pixel against every triangle, by solving for its weights."""
    inverse_depth = np.zeros((height, width))
    triangle = np.full((height, width), -1)
    v, u = np.mgrid[0:height, 0:width]
    pixels = np.stack([u.ravel(), v.ravel(), np.ones(u.size)])
    for index, face in enumerate(faces):
        corners = screen[face]
        system = np.vstack([corners[:, 0], corners[:, 1], np.ones(3)])
        # Counter-clockwise from outside is a negative area with v downwards.
        if np.linalg.det(system) > -1e-12 or (corners[:, 2] <= 0).any():
            continue
        weights = np.linalg.solve(system, pixels)
        nearness = (corners[:, 2] @ weights).reshape(height, width)
        inside = (weights >= -1e-12).all(axis=0).reshape(height, width)
        closer = inside & (nearness > inverse_depth)
        inverse_depth[closer] = nearness[closer]
        triangle[closer] = index
    return inverse_depth, triangle
