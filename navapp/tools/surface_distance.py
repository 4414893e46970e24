"""Distance of points from a bone's surface."""

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray

_USUAL_SIZES = 3.0


class SurfaceDistance:
    """Finds the nearest place of a surface; the first call builds its tree.

    Args:
        surface: with outward normals, mm.
    """

    def __init__(self, surface: TriangleMesh) -> None:
        from scipy.spatial import cKDTree

        self._corners = surface.vertices_mm[surface.faces]
        self._tree = cKDTree(self._corners.mean(axis=1))
        edges = self._corners[:, 1:] - self._corners[:, :1]
        # Large triangles reach far from their middles: the few largest are always looked at.
        sizes_mm = np.linalg.norm(edges, axis=2).max(axis=1)
        self._reach_mm = _USUAL_SIZES * float(np.median(sizes_mm))
        self._large = np.flatnonzero(sizes_mm > self._reach_mm)
        normals = np.cross(edges[:, 0], edges[:, 1])
        self._normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)

    def find(self, point_mm: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Of a point (3,): signed distance (positive outside), nearest place, unit normal there."""
        first, _ = self._tree.query(point_mm, k=1)
        around = self._tree.query_ball_point(point_mm, first + self._reach_mm)
        near = np.union1d(np.array(around, dtype=int), self._large)
        places = _nearest_on_triangles(point_mm, self._corners[near])
        distances = np.linalg.norm(places - point_mm, axis=1)
        best = int(distances.argmin())
        # Beside an edge the triangles of both sides are as near: their mean tells the side.
        tied = near[distances <= distances[best] + 1e-9]
        normal = self._normals[tied].mean(axis=0)
        normal /= max(float(np.linalg.norm(normal)), 1e-12)
        side = 1.0 if (point_mm - places[best]) @ normal >= 0.0 else -1.0
        return side * float(distances[best]), places[best], normal


def _nearest_on_triangles(point_mm: FloatArray, corners_mm: FloatArray) -> FloatArray:
    """(n, 3) the nearest place of each of (n, 3, 3) triangles.

    Inside, where the point's foot lies in the triangle; else on the nearest of its three sides.
    """
    a = corners_mm[:, 0]
    u, v = corners_mm[:, 1] - a, corners_mm[:, 2] - a
    w = point_mm - a
    uu, uv, vv = (np.einsum("nj,nj->n", p, q) for p, q in ((u, u), (u, v), (v, v)))
    wu, wv = np.einsum("nj,nj->n", w, u), np.einsum("nj,nj->n", w, v)
    determinant = np.maximum(uu * vv - uv * uv, 1e-18)
    s, t = (vv * wu - uv * wv) / determinant, (uu * wv - uv * wu) / determinant
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)
    places = a + s[:, None] * u + t[:, None] * v
    on_sides = np.stack(
        [_nearest_on_line(point_mm, corners_mm[:, k], corners_mm[:, (k + 1) % 3]) for k in range(3)]
    )
    nearest = np.linalg.norm(on_sides - point_mm, axis=2).argmin(axis=0)
    beside: FloatArray = on_sides[nearest, np.arange(len(a))]
    return np.where(inside[:, None], places, beside)


def _nearest_on_line(point_mm: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    along = b - a
    length2 = np.maximum(np.einsum("nj,nj->n", along, along), 1e-18)
    share = np.clip(np.einsum("nj,nj->n", point_mm - a, along) / length2, 0.0, 1.0)
    place: FloatArray = a + share[:, None] * along
    return place
