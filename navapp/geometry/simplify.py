"""The same surface in fewer triangles: no vertex of the old one lies far from the new one."""

from functools import lru_cache

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray

_DRAWN_VERTICES, _DRAWN_WITHIN_MM = 6500, 0.1
# The nearest triangle is looked for among so many whose middles are nearest.
_N_TRIANGLES = 12


@lru_cache(maxsize=16)
def drawn(mesh: TriangleMesh) -> TriangleMesh:
    """A mesh in as many triangles as a picture can show; made once for each mesh.

    Drawing takes as long as there are triangles, and a camera cannot tell the difference.
    """
    return simplify(mesh, _DRAWN_VERTICES, _DRAWN_WITHIN_MM)


@lru_cache(maxsize=16)
def is_closed(mesh: TriangleMesh) -> bool:
    """Whether a mesh has no border and looks outward: it shows no inner side."""
    faces = mesh.faces.astype(np.int64)
    if len(faces) == 0:
        return False
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    n = len(mesh.vertices_mm)
    # Each edge is gone along once in each direction, by the two triangles beside it.
    along, back = np.sort(start * n + end), np.sort(end * n + start)
    has_pairs = np.array_equal(along, back) and len(np.unique(along)) == len(along)
    return bool(has_pairs and mesh.volume_mm3() > 0.0)


def count_outward(mesh: TriangleMesh) -> int:
    """How many triangles of a mesh show no inner side: all of a closed one, else none."""
    return len(mesh.faces) if is_closed(mesh) else 0


def simplify(mesh: TriangleMesh, n_vertices: int, within_mm: float) -> TriangleMesh:
    """A mesh of about so many vertices, or of as many as the distance asks for.

    Args:
        mesh: any.
        n_vertices: wanted; a smaller mesh is handed back as it is.
        within_mm: no vertex of the mesh lies further from the new surface.

    Source: Garland and Heckbert 1997, quadric error metrics.
    """
    while 0 < n_vertices < len(mesh.vertices_mm):
        candidate = _collapse(mesh, n_vertices)
        if candidate is not None and is_within(mesh, candidate, within_mm):
            return candidate
        n_vertices *= 2
    return mesh


def is_within(mesh: TriangleMesh, surface: TriangleMesh, distance_mm: float) -> bool:
    """Whether no vertex that a mesh uses lies further from another surface."""
    from scipy.spatial import cKDTree

    points = mesh.vertices_mm[np.unique(mesh.faces)]
    corners = surface.vertices_mm[surface.faces]
    middles = corners.mean(axis=1)
    n_near = min(_N_TRIANGLES, len(corners))
    _, near = cKDTree(middles).query(points, k=n_near, workers=2)
    nearest, in_doubt = np.full(len(points), np.inf), np.arange(len(points))
    for triangle in near.reshape(len(points), n_near).T:
        off = _to_triangles_mm(points[in_doubt], corners[triangle[in_doubt]])
        nearest[in_doubt] = np.minimum(nearest[in_doubt], off)
        in_doubt = in_doubt[nearest[in_doubt] > distance_mm]
    # A large triangle lies nearer than its middle tells: those in doubt are asked of all that reach
    # so far. The worst first, so that a surface that is too far away is soon found out.
    reach_mm = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1) + distance_mm
    for point in points[in_doubt[np.argsort(-nearest[in_doubt])]]:
        able = corners[np.linalg.norm(middles - point, axis=1) <= reach_mm]
        off = _to_triangles_mm(np.broadcast_to(point, (len(able), 3)), able)
        if not (off <= distance_mm).any():
            return False
    return True


def _collapse(mesh: TriangleMesh, n_vertices: int) -> TriangleMesh | None:
    """The mesh after edge collapses; None when the library makes nothing sensible of it."""
    import fast_simplification

    share = 1.0 - n_vertices / len(mesh.vertices_mm)
    # About the middle, float32 keeps its digits.
    middle = mesh.centroid_mm
    points, faces = fast_simplification.simplify(
        np.asarray(mesh.vertices_mm - middle, dtype=np.float32),
        np.array(mesh.faces),
        target_reduction=share,
    )
    if len(faces) == 0 or not np.isfinite(points).all():
        return None
    return TriangleMesh(np.asarray(points, dtype=float) + middle, np.asarray(faces, np.int32))


def _to_triangles_mm(points: FloatArray, corners: FloatArray) -> FloatArray:
    """(N,) distance of points (N, 3) from triangles (N, 3, 3)."""
    nearest = np.min(
        [_to_edges_mm(points, corners[:, k], corners[:, (k + 1) % 3]) for k in range(3)], axis=0
    )
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    is_inside = length > 0.0
    for k in range(3):
        edge = corners[:, (k + 1) % 3] - corners[:, k]
        side = np.einsum("ij,ij->i", np.cross(edge, points - corners[:, k]), normal)
        is_inside &= side >= 0.0
    above = np.abs(np.einsum("ij,ij->i", points - corners[:, 0], normal))
    distance: FloatArray = np.where(is_inside, above / np.where(length > 0.0, length, 1.0), nearest)
    return distance


def _to_edges_mm(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    edge = end - start
    squared = np.einsum("ij,ij->i", edge, edge)
    along = np.einsum("ij,ij->i", points - start, edge) / np.where(squared > 0.0, squared, 1.0)
    foot = start + np.clip(along, 0.0, 1.0)[:, None] * edge
    distance: FloatArray = np.linalg.norm(points - foot, axis=1)
    return distance
