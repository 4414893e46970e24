"""Finds visible edges of a bone's mesh: creases, apart from borders where the mesh ends."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_edges import face_pairs, open_border
from navapp.geometry.transform import FloatArray
from navapp.preop.cut_ends import on_flat_caps

# So far around the end of a mesh it is not trusted either.
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


def find_near_ends(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices at open borders and on flat caps, with what lies close to them."""
    from scipy.spatial import cKDTree

    is_end: NDArray[np.bool_] = on_flat_caps(mesh) | open_border(len(mesh.vertices_mm), mesh.faces)
    if not is_end.any():
        return is_end
    distance, _ = cKDTree(mesh.vertices_mm[is_end]).query(mesh.vertices_mm)
    return np.asarray(distance < _AROUND_MM)


def find_creases(mesh: TriangleMesh, is_wanted: NDArray[np.bool_]) -> Crease:
    """Wanted vertices where the surface bends sharply, more than beside them.

    Args:
        mesh: of a bone.
        is_wanted: (V,) where creases are looked for.
    """
    edges, _ = face_pairs(mesh.faces)
    normals = _smooth_normals(mesh, edges)
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


def _smooth_normals(mesh: TriangleMesh, edges: NDArray[np.int32]) -> FloatArray:
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
