"""What of a bone's mesh is an edge to the eye, and what is only the end of the mesh."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_edges import half_edges, paired_half_edges
from navapp.geometry.transform import FloatArray

# A flat piece at least so large is the cap of a cut shaft: no bone is as flat.
_CAP_MM2 = 150.0
_FLAT_COSINE, _FLAT_MM = 0.9995, 0.4
# So far around it the mesh is not trusted either.
_AROUND_MM = 3.0
# A crease bends at least as sharply, and so much more across than along.
_SHARPEST_RADIUS_MM = 7.0
_ACROSS_OVER_ALONG = 2.0
_SMOOTHING_MM = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Crease:
    """Points of ridges and grooves: (N, 3) each, positions in mm, unit tangents and normals."""

    points_mm: FloatArray
    tangents: FloatArray
    normals: FloatArray


def no_anatomy(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices at open borders and on flat caps, with what lies close to them."""
    from scipy.spatial import cKDTree

    is_end = np.zeros(len(mesh.vertices_mm), dtype=bool)
    pairs, faces_of_pair = _face_pairs(mesh.faces)
    is_end[pairs[faces_of_pair[:, 1] < 0].ravel()] = True
    is_end[mesh.faces[_is_cap(mesh, faces_of_pair)].ravel()] = True
    if not is_end.any():
        return is_end
    distance, _ = cKDTree(mesh.vertices_mm[is_end]).query(mesh.vertices_mm)
    return np.asarray(distance < _AROUND_MM)


def creases(mesh: TriangleMesh, is_wanted: NDArray[np.bool_]) -> Crease:
    """Wanted vertices where the surface bends sharply, more than beside them.

    Args:
        mesh: of a bone.
        is_wanted: (V,) where creases are looked for.
    """
    edges, _ = _face_pairs(mesh.faces)
    normals = _smoothed(mesh, edges)
    offset = mesh.vertices_mm[edges[:, 1]] - mesh.vertices_mm[edges[:, 0]]
    length = np.maximum(np.linalg.norm(offset, axis=1), 1e-6)
    turn = (normals[edges[:, 1]] - normals[edges[:, 0]]) / length[:, None]
    # Squares of how the normal turns along each edge: the largest is across a crease.
    tensor = np.zeros((len(normals), 3, 3))
    product = turn[:, :, None] * turn[:, None, :]
    count = np.bincount(edges.ravel(), minlength=len(normals))
    for side in range(2):
        np.add.at(tensor, edges[:, side], product)
    tensor *= (2.0 / np.maximum(count, 1))[:, None, None]
    values, vectors = np.linalg.eigh(tensor)
    strength = np.sqrt(np.maximum(values[:, 2], 0.0))
    is_line = strength > _ACROSS_OVER_ALONG * np.sqrt(np.maximum(values[:, 1], 0.0))
    is_sharp = is_wanted & is_line & (strength > 1.0 / _SHARPEST_RADIUS_MM)
    across = vectors[:, :, 2]
    for side in range(2):
        here, there = edges[:, side], edges[:, 1 - side]
        beside = np.abs(np.einsum("ij,ij->i", offset, across[here])) > 0.7 * length
        is_sharp[here[beside & (strength[there] > strength[here])]] = False
    tangents = np.cross(normals[is_sharp], across[is_sharp])
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-12)
    return Crease(mesh.vertices_mm[is_sharp], tangents, np.asarray(mesh.normals)[is_sharp])


def _smoothed(mesh: TriangleMesh, edges: NDArray[np.int32]) -> FloatArray:
    """(V, 3) normals averaged over neighbours, over about the same length for every mesh."""
    from scipy.sparse import coo_matrix, identity

    n = len(mesh.vertices_mm)
    offset = mesh.vertices_mm[edges[:, 1]] - mesh.vertices_mm[edges[:, 0]]
    spacing_mm = max(float(np.median(np.linalg.norm(offset, axis=1))), 1e-3)
    rounds = min(max(round(2.0 * (_SMOOTHING_MM / spacing_mm) ** 2), 1), 30)
    ones = np.ones(len(edges))
    half = coo_matrix((ones, (edges[:, 0], edges[:, 1])), shape=(n, n)).tocsr()
    around = (half + half.T + identity(n)).tocsr()
    normals: FloatArray = np.array(mesh.normals)
    for _ in range(rounds):
        normals = np.asarray(around @ normals)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return normals


def _face_pairs(faces: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """(E, 2) edges, and (E, 2) the faces on both sides of each; -1 where there is none."""
    halves = paired_half_edges(faces)
    edges = np.sort(half_edges(faces)[halves[:, 0]], axis=1)
    return edges, np.where(halves >= 0, halves % len(faces), -1)


def _is_cap(mesh: TriangleMesh, faces_of_pair: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(F,) triangles of large flat pieces."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    corners = mesh.vertices_mm[mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(across, axis=1)
    normals = across / np.maximum(2.0 * area, 1e-12)[:, None]
    inner = faces_of_pair[faces_of_pair[:, 1] >= 0]
    is_flat = np.einsum("ij,ij->i", normals[inner[:, 0]], normals[inner[:, 1]]) > _FLAT_COSINE
    joined = inner[is_flat]
    n = len(mesh.faces)
    graph = coo_matrix((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(n, n))
    _, piece = connected_components(graph, directed=False)
    is_cap = np.zeros(n, dtype=bool)
    for large in np.flatnonzero(np.bincount(piece, area) > _CAP_MM2):
        inside = piece == large
        normal = (normals[inside] * area[inside, None]).sum(axis=0)
        normal /= np.linalg.norm(normal)
        off = corners[inside].reshape(-1, 3) @ normal
        is_cap |= inside & bool(np.ptp(off) < _FLAT_MM)
    return is_cap
