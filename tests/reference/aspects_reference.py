"""Readable versions of the compiled loops of the aspect graph."""

import numpy as np


def contour_pieces(vertices, faces, facing):
    """(n, 2, 3) ends of the pieces where the linear interpolation of `facing` is zero."""
    pieces = []
    for face in faces:
        ends = []
        for a, b in zip(face, np.roll(face, -1), strict=True):
            if (facing[a] > 0) != (facing[b] > 0):
                share = facing[a] / (facing[a] - facing[b])
                ends.append((1 - share) * vertices[a] + share * vertices[b])
        if len(ends) == 2 and np.linalg.norm(ends[1] - ends[0]) >= 1e-9:
            pieces.append(ends)
    return np.array(pieces).reshape(-1, 2, 3)


def farthest_first(points, n):
    """Indices: each next point is the furthest from all before it."""
    order = [0]
    while len(order) < n:
        distance = np.linalg.norm(points[:, None] - points[order], axis=2).min(axis=1)
        if distance.max() == 0.0:
            break
        order.append(int(distance.argmax()))
    return order
