"""Cleans users' surfaces for registration: repairs, orients and thins them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.surface_files import merge_rows
from navapp.geometry.transform import FloatArray

# Pieces of fewer triangles than this share of the largest one's are strays.
_TINY_FRACTION = 0.01
# A surface whose openings are this share of it still has an inside.
_OPEN_FRACTION = 0.25
_NORMAL_NEIGHBOURS = 16


@dataclass(frozen=True, slots=True, eq=False)
class MendedSurface:
    """A repaired surface, with notes for people."""

    mesh: TriangleMesh
    notes: tuple[str, ...]


def mend(mesh: TriangleMesh) -> MendedSurface:
    """A triangle mesh without repeated vertices, strays and inward normals.

    Vertices at exactly the same place become one; triangles without area or of the same corners as
    another, tiny separate pieces and vertices of no triangle go; a surface that is all but closed
    is turned outward. Normals follow from the faces.
    """
    notes: list[str] = []
    first, kind = merge_rows(mesh.vertices_mm)
    faces = kind[mesh.faces]
    vertices = mesh.vertices_mm[first]
    _, double_area = _areas(vertices, faces)
    faces = faces[double_area > 0.0]
    faces = faces[merge_rows(np.sort(faces, axis=1))[0]]
    if len(faces) == 0:
        return MendedSurface(TriangleMesh(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32)), ())
    is_stray = _strays(len(vertices), faces)
    if is_stray.any():
        notes.append(f"{is_stray.sum()} triangles of tiny separate pieces were left out")
    whole = _of_faces(vertices, faces[~is_stray])
    if whole.volume_mm3() < 0.0:
        vectors, double_area = _areas(whole.vertices_mm, whole.faces)
        if np.linalg.norm(vectors.sum(axis=0)) < _OPEN_FRACTION * double_area.sum():
            whole = whole.flip()
            notes.append("its normals pointed inwards and were turned")
        else:
            notes.append("it is open, and its normals may point inwards; they were not turned")
    return MendedSurface(whole, tuple(notes))


def thin(mesh: TriangleMesh, n_vertices: int) -> TriangleMesh:
    """About the same surface with at most about so many vertices, evenly spread.

    Even, because points pair with vertices: fewer where it is flat would leave gaps.

    Source: vertex clustering, Rossignac and Borrel 1993.
    """
    cell = _cells(mesh.vertices_mm, n_vertices)
    n = np.bincount(cell)
    middles, normals = (
        np.column_stack([np.bincount(cell, axis) / n for axis in values.T])
        for values in (mesh.vertices_mm, mesh.normals)
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    faces = np.sort(cell[mesh.faces], axis=1)
    is_face = (faces[:, 0] < faces[:, 1]) & (faces[:, 1] < faces[:, 2])
    corners = cell[mesh.faces[is_face]]
    first, kind = merge_rows(faces[is_face])
    # Two triangles that fall onto each other are a fold that has closed: both go.
    used, index = np.unique(corners[first[np.bincount(kind) % 2 == 1]], return_inverse=True)
    kept = index.reshape(-1, 3).astype(np.int32)
    return TriangleMesh(middles[used], kept, normals[used])


def estimate_normals(points: FloatArray) -> FloatArray:
    """(N, 3) unit normals of a cloud, alike along each connected part of it, and outward.

    Outward means away from the cloud's mean, over a part as a whole.

    Args:
        points: (N, 3), at least 4, no two equal.

    Source: planes through the nearest points, turned along a spanning tree, Hoppe et al. 1992.
    """
    from scipy.spatial import cKDTree

    k = min(_NORMAL_NEIGHBOURS, len(points))
    near = np.asarray(cKDTree(points).query(points, k=k)[1])
    offset = points[near] - points[near].mean(axis=1, keepdims=True)
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", offset, offset))
    normals: FloatArray = vectors[:, :, 0]
    sign, part = _find_agreeing_signs(normals, near[:, 1:])
    normals *= sign[:, None]
    outward = np.einsum("ij,ij->i", normals, points - points.mean(axis=0))
    normals *= np.where(np.bincount(part, outward) < 0.0, -1.0, 1.0)[part][:, None]
    return normals


def thin_evenly(points: FloatArray, n_wanted: int) -> NDArray[np.int64]:
    """(M,) ascending rows of at most about so many points, one in each cell of a grid."""
    _, first = np.unique(_cells(points, n_wanted), return_index=True)
    return np.sort(first)


def measure_spacing(points: FloatArray) -> float:
    """Median distance of (N, 3) points, at least 2, from their nearest neighbour."""
    from scipy.spatial import cKDTree

    distance = np.asarray(cKDTree(points).query(points, k=2)[0])
    return float(np.median(distance[:, 1]))


def _cells(points: FloatArray, n_wanted: int) -> NDArray[np.int64]:
    """(N,) number, from 0 on, of the cell of a grid that each point is in; so many have points."""
    low = points.min(axis=0)
    width = float(np.ptp(points, axis=0).max()) / n_wanted**0.5
    for _ in range(20):
        cell = np.floor((points - low) / width).astype(np.int64)
        number = np.ravel_multi_index(tuple(cell.T), tuple(cell.max(axis=0) + 1))
        filled, index = np.unique(number, return_inverse=True)
        if 0.8 * n_wanted <= len(filled) <= n_wanted:
            break
        width *= (len(filled) / (0.9 * n_wanted)) ** 0.5
    return index


def _areas(vertices: FloatArray, faces: NDArray[np.integer]) -> tuple[FloatArray, FloatArray]:
    """(F, 3) vectors along the triangles' normals, as long as twice the area; those lengths."""
    corners = vertices[faces]
    vectors: FloatArray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return vectors, np.linalg.norm(vectors, axis=1)


def _strays(n_vertices: int, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(F,) whether a triangle belongs to a tiny separate piece."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = np.concatenate([faces[:, :2], faces[:, 1:]])
    ones = np.ones(len(edges), dtype=np.int8)
    graph = coo_matrix((ones, (edges[:, 0], edges[:, 1])), shape=(n_vertices, n_vertices))
    _, piece_of_vertex = connected_components(graph, directed=False)
    piece = piece_of_vertex[faces[:, 0]]
    counts = np.bincount(piece)
    is_stray: NDArray[np.bool_] = (counts < _TINY_FRACTION * counts.max())[piece]
    return is_stray


def _of_faces(vertices: FloatArray, faces: NDArray[np.int64]) -> TriangleMesh:
    """The mesh of the vertices that a face names."""
    used, index = np.unique(faces, return_inverse=True)
    return TriangleMesh(vertices[used], index.reshape(-1, 3).astype(np.int32))


def _find_agreeing_signs(
    normals: FloatArray, near: NDArray[np.integer]
) -> tuple[FloatArray, NDArray[np.int32]]:
    """(N,) signs that make neighbours' normals agree, and which connected part each point is of."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import (
        breadth_first_order,
        connected_components,
        minimum_spanning_tree,
    )

    n = len(normals)
    rows, columns = np.repeat(np.arange(n), near.shape[1]), near.ravel()
    # Across a bend normals say little of each other; the tree goes around it where it can.
    cost = 1.001 - np.abs(np.einsum("ij,ij->i", normals[rows], normals[columns]))
    tree = minimum_spanning_tree(coo_matrix((cost, (rows, columns)), shape=(n, n)).tocsr()).tocoo()
    _, part = connected_components(tree, directed=False)
    # One point of each part hangs on an extra root, so that one walk reaches all.
    _, heads = np.unique(part, return_index=True)
    ends = np.concatenate([tree.row, np.full(len(heads), n)])
    others = np.concatenate([tree.col, heads])
    rooted = coo_matrix((np.ones(len(ends)), (ends, others)), shape=(n + 1, n + 1)).tocsr()
    order, before = breadth_first_order(rooted, n, directed=False)
    parent = np.where(before[:n] == n, np.arange(n), before[:n])
    agrees = np.einsum("ij,ij->i", normals, normals[parent]) >= 0.0
    sign = np.ones(n)
    for point in order[1:]:
        sign[point] = sign[parent[point]] * (1.0 if agrees[point] else -1.0)
    return sign, part
