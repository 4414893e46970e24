"""Edges of a mesh and the triangles on both sides: where it ends, where its outline can run."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import IntArray, TriangleMesh
from navapp.geometry.transform import FloatArray


class RidgeEdges(NamedTuple):
    """Edges over which a mesh bends outward, and the planes of its triangles.

    An outline runs over such edges only: of their two triangles one looks at the eye, the other
    away. Open borders are left out: there the model ends, not the bone.
    """

    vertices_mm: FloatArray  # (V, 3) of the mesh
    edges: IntArray  # (E, 2) vertices
    faces: IntArray  # (E, 2) the two triangles
    opposite: IntArray  # (E, 2) the third vertex of either
    # (4, F) unit outward normal n of each triangle, 0 without area, and n.x in mm on it.
    planes: NDArray[np.float32]


def ridge_edges(mesh: TriangleMesh) -> RidgeEdges:
    """Edges of a mesh that two triangles share and that are not grooves."""
    corners = np.array(mesh.vertices_mm)
    normals, offsets = _planes(corners, mesh.faces)
    halves = pair_half_edges(mesh.faces)
    one, other = halves[halves[:, 1] >= 0].T
    third = np.concatenate([mesh.faces[:, 2], mesh.faces[:, 0], mesh.faces[:, 1]])
    face = np.tile(np.arange(len(mesh.faces), dtype=np.int32), 3)
    beyond = np.einsum("ij,ij->i", normals[face[one]], corners[third[other]]) - offsets[face[one]]
    is_ridge = beyond < 0.0
    one, other = one[is_ridge], other[is_ridge]
    return RidgeEdges(
        corners,
        np.ascontiguousarray(half_edges(mesh.faces)[one], dtype=np.int32),
        _pairs(face[one], face[other]),
        _pairs(third[one], third[other]),
        np.ascontiguousarray(np.vstack([normals.T, offsets]), dtype=np.float32),
    )


def half_edges(faces: IntArray) -> IntArray:
    """(3 F, 2) first and second vertex: the first edge of every triangle, then the second, ..."""
    ends: IntArray = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return ends


def pair_half_edges(faces: IntArray) -> NDArray[np.int64]:
    """(E, 2) the two `half_edges` of every edge, of triangles h % F; -1 where there is one only.

    Edges of more than two triangles keep the first two.
    """
    low, high = np.sort(half_edges(faces), axis=1).T.astype(np.int64)
    # One number sorts faster than two.
    edge = low * (high.max(initial=0) + 1) + high
    order = np.argsort(edge, kind="stable")
    first = np.flatnonzero(np.diff(edge[order], prepend=-1))
    is_double = np.diff(np.append(first, len(edge))) >= 2
    second = np.where(is_double, order[np.minimum(first + 1, len(edge) - 1)], -1)
    return np.column_stack([order[first], second])


def open_border(n_vertices: int, faces: IntArray) -> NDArray[np.bool_]:
    """(V,) vertices on an edge of one triangle only: there the model ends, not the bone."""
    halves = pair_half_edges(faces)
    is_border = np.zeros(n_vertices, dtype=bool)
    is_border[half_edges(faces)[halves[halves[:, 1] < 0, 0]].ravel()] = True
    return is_border


def face_pairs(faces: IntArray) -> tuple[IntArray, NDArray[np.int64]]:
    """(E, 2) edges, and (E, 2) the triangles on both sides of each; -1 where there is none."""
    halves = pair_half_edges(faces)
    edges = np.sort(half_edges(faces)[halves[:, 0]], axis=1)
    return edges, np.where(halves >= 0, halves % max(len(faces), 1), -1)


def _planes(corners: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    a, b, c = (corners[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return normals, np.einsum("ij,ij->i", normals, a)


def _pairs(first: NDArray[np.int32], second: NDArray[np.int32]) -> IntArray:
    return np.ascontiguousarray(np.column_stack([first, second]), dtype=np.int32)
