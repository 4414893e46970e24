"""Vertices of damaged cartilage: those within an outline, or near points."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray

# A point marks what a fingertip would: a spot of this radius.
SPOT_RADIUS_MM = 4.0
# Outlines are drawn on cartilage or beside the surface; the far side of a bone lies deeper.
_DEPTH_MM = 6.0


def paint_near(mesh: TriangleMesh, points_mm: FloatArray) -> NDArray[np.int64]:
    """Indices of the vertices within 4 mm of a point: a spot each."""
    from scipy.spatial import cKDTree

    distance_mm = cKDTree(points_mm).query(mesh.vertices_mm)[0]
    return np.flatnonzero(distance_mm <= SPOT_RADIUS_MM).astype(np.int64)


def paint_within(mesh: TriangleMesh, outline_mm: FloatArray) -> NDArray[np.int64]:
    """Indices of the vertices within a closed outline that lies on or near the surface.

    The outline is looked at along the mean normal of the surface beneath it. Inside it a vertex
    must face that way; it may lie further from the outline's plane than the outline itself by its
    radius (a condyle bulges through its outline), and by 6 mm for what was drawn on cartilage.

    Args:
        mesh: of the bone.
        outline_mm: (N, 3), N >= 3, in order; the last point is joined to the first.
    """
    import cv2
    from scipy.spatial import cKDTree

    middle = outline_mm.mean(axis=0)
    _, beneath = cKDTree(mesh.vertices_mm).query(outline_mm)
    towards = mesh.normals[beneath].mean(axis=0)
    length = float(np.linalg.norm(towards))
    if length < 0.1:  # it runs round the bone: no side of it is meant
        return np.empty(0, dtype=np.int64)
    towards = towards / length
    u = np.cross(towards, np.eye(3)[int(np.argmin(np.abs(towards)))])
    u /= np.linalg.norm(u)
    axes = np.stack([u, np.cross(towards, u)])
    offset = mesh.vertices_mm - middle
    flat = (outline_mm - middle) @ axes.T
    deepest_mm = float(np.linalg.norm(flat, axis=1).max()) + _DEPTH_MM
    candidates = np.flatnonzero(
        (mesh.normals @ towards > 0.0) & (np.abs(offset @ towards) < deepest_mm)
    )
    polygon = flat.astype(np.float32)
    inside = [
        cv2.pointPolygonTest(polygon, (float(x), float(y)), False) >= 0.0
        for x, y in offset[candidates] @ axes.T
    ]
    painted: NDArray[np.int64] = candidates[np.array(inside, dtype=bool)]
    return painted
