"""The outline kernels in plain numpy."""

import numpy as np
from scipy.ndimage import map_coordinates


def rim(vertices, edges, faces, opposite, planes, pose, eye):
    """Points, pixels, outward normals, lengths and edges of a mesh's rim, hidden ones too."""
    seat = pose.inverse().apply(np.array([[eye.x_mm, 0.0, 0.0]]))[0]
    looks = seat @ planes[:3] > planes[3]
    found = np.flatnonzero(looks[faces[:, 0]] != looks[faces[:, 1]])
    third = np.where(looks[faces[found, 0]], opposite[found, 0], opposite[found, 1])
    ends = [pose.apply(vertices[index]) for index in (edges[found, 0], edges[found, 1], third)]
    start, end, inner = (seen(points, eye) for points in ends)
    point = 0.5 * (ends[0] + ends[1])
    length = np.linalg.norm(end - start, axis=1)
    normal = np.column_stack([end[:, 1] - start[:, 1], start[:, 0] - end[:, 0]]) / length[:, None]
    normal *= -np.sign(((inner - start) * normal).sum(axis=1))[:, None]
    return point, seen(point, eye), normal, length, found


def seen(points, eye):
    """(N, 2) px."""
    offset = points[:, :2] - (eye.x_mm, 0.0)
    return eye.focal_px * offset / points[:, 2:] + (eye.centre_x_px, eye.centre_y_px)


def is_outline(pixel, normal, z, depth, first_column, first_row):
    """(N,) nothing hides it, and three pixels beyond it the surface has ended."""
    answer = np.ones(len(pixel), dtype=bool)
    for k in range(4):
        at = np.floor(pixel + k * normal + 0.5).astype(int) - (first_column, first_row)
        inside = ((at >= 0) & (at < depth.shape[::-1])).all(axis=1)
        there = np.full(len(pixel), np.nan)
        there[inside] = depth[at[inside, 1], at[inside, 0]]
        answer &= ~(there <= z + (-1.0 if k == 0 else 3.0)) & (inside | (k > 0))
    return answer


def smoothed(pixel, normal, length):
    """(N, 2) normals over neighbours within 4 px, and (N,) whether none near is further out."""
    offset = pixel[None] - pixel[:, None]
    distance = np.linalg.norm(offset, axis=2)
    is_same = normal @ normal.T > 0.5
    total = np.where(is_same & (distance <= 4.0), length, 0.0) @ normal
    unit = total / np.linalg.norm(total, axis=1, keepdims=True)
    further = np.einsum("ijk,ik->ij", offset, unit)
    is_outermost = ~(is_same & (distance < 1.5) & (further >= 0.2)).any(axis=1)
    return unit, is_outermost


def profile(picture, x, y, normal, half):
    """(2 half + 1,) grey values each half pixel along a normal, mean of three lines."""
    along = 0.5 * np.arange(-half, half + 1)
    tangent = np.array([-normal[1], normal[0]])
    lines = [np.array([x, y]) + np.outer(along, normal) + side * tangent
             for side in (-1, 0, 1)]  # fmt: skip
    values = [map_coordinates(picture.astype(float), line.T[::-1], order=1) for line in lines]
    return np.mean(values, axis=0)


def missing_fraction(values):
    """Fraction of the level inside an edge, 2 to 4 px from it, that is missing outside."""
    at = 0.5 * np.arange(-8, 9)
    inside, outside = values[at <= -2.0].mean(), values[at >= 2.0].mean()
    return (inside - outside) / max(inside, 1.0)
