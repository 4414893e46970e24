"""Edges that two triangles of a mesh share: where its outline can run."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import IntArray, TriangleMesh
from navapp.geometry.transform import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class RidgeEdges:
    """Edges over which a mesh bends outward, and the planes of its triangles.

    An outline runs over such edges only: of their two triangles one looks at the eye, the other
    away. Open borders are left out: there the model ends, not the bone.

    Attributes:
        vertices_mm: (V, 3) of the mesh.
        edges: (E, 2) vertices.
        faces: (E, 2) the two triangles.
        opposite: (E, 2) the third vertex of either.
        planes: (4, F) unit outward normal n of each triangle, 0 without area, and n.x in mm on it.
    """

    vertices_mm: FloatArray
    edges: IntArray
    faces: IntArray
    opposite: IntArray
    planes: NDArray[np.float32]


def ridge_edges(mesh: TriangleMesh) -> RidgeEdges:
    """Edges of a mesh that two triangles share and that are not grooves."""
    corners = np.array(mesh.vertices_mm)
    normals, offsets = _planes(corners, mesh.faces)
    ends = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    third = np.concatenate([mesh.faces[:, 2], mesh.faces[:, 0], mesh.faces[:, 1]])
    face = np.tile(np.arange(len(mesh.faces), dtype=np.int32), 3)
    low, high = ends.min(axis=1), ends.max(axis=1)
    key = low.astype(np.int64) * max(len(corners), 1) + high
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, other = order[first], order[first + 1]
    beyond = np.einsum("ij,ij->i", normals[face[one]], corners[third[other]]) - offsets[face[one]]
    is_ridge = beyond < 0.0
    one, other = one[is_ridge], other[is_ridge]
    return RidgeEdges(
        corners,
        np.ascontiguousarray(ends[one], dtype=np.int32),
        _pairs(face[one], face[other]),
        _pairs(third[one], third[other]),
        np.ascontiguousarray(np.vstack([normals.T, offsets]), dtype=np.float32),
    )


def _planes(corners: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    a, b, c = (corners[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return normals, np.einsum("ij,ij->i", normals, a)


def _pairs(first: NDArray[np.int32], second: NDArray[np.int32]) -> IntArray:
    return np.ascontiguousarray(np.column_stack([first, second]), dtype=np.int32)
