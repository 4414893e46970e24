"""Neighbours of each point of a surface, and how the surface bends there."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from navapp.geometry.mesh_edges import half_edges
from navapp.geometry.transform import FloatArray

# All chosen. Of a vertex at most; of a point that no edge touches.
_MAX_NEIGHBOURS = 12
_CLOUD_NEIGHBOURS = 8
# A radius of curvature below so many spacings is a crease or noise, not a surface that bends.
_TIGHTEST_RADIUS = 1.5


def find_neighbours(points_mm: FloatArray, faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """(V, K) vertices beside each of (V, 3), padded with -1.

    Along the edges of the faces (F, 3); the nearest ones, made mutual, for vertices that no edge
    touches.
    """
    n = len(points_mm)
    pairs = half_edges(faces)
    is_alone = np.ones(n, dtype=bool)
    is_alone[faces.ravel()] = False
    alone = np.flatnonzero(is_alone)
    if len(alone):
        _, index = cKDTree(points_mm).query(points_mm[alone], k=min(_CLOUD_NEIGHBOURS + 1, n))
        index = np.asarray(index).reshape(len(alone), -1)
        near = np.column_stack([np.repeat(alone, index.shape[1]), index.ravel()])
        pairs = np.concatenate([pairs, near[near[:, 0] != near[:, 1]]])
    one, other = pairs.T.astype(np.int64)
    # Both ways, by the first and then by the second: one number sorts faster than two.
    start, end = np.divmod(np.unique(np.concatenate([one * n + other, other * n + one])), n)
    rank = np.arange(len(start)) - np.searchsorted(start, np.arange(n))[start]
    table = np.full((n, _MAX_NEIGHBOURS), -1, dtype=np.int32)
    kept = rank < _MAX_NEIGHBOURS
    table[start[kept], rank[kept]] = end[kept]
    return table


def compute_curvature(
    points_mm: FloatArray, normals: FloatArray, neighbours: NDArray[np.int32]
) -> tuple[FloatArray, FloatArray]:
    """How the normal turns around each vertex, and how far its neighbours are.

    The second fundamental form: the symmetric matrix B in the tangent plane of vertex i that best
    explains its neighbours' normals, n_j - n_i = B (p_j - p_i).

    Returns:
        (V, 6) entries xx, yy, zz, xy, xz, yz of B in 1/mm, and (V,) mean distance in mm.
    """
    is_there = neighbours >= 0
    index = np.where(is_there, neighbours, 0)
    offset = np.where(is_there[..., None], points_mm[index] - points_mm[:, None], 0.0)
    turned = np.where(is_there[..., None], normals[index] - normals[:, None], 0.0)
    n_there = np.maximum(is_there.sum(axis=1), 1)
    spacing = np.linalg.norm(offset, axis=2).sum(axis=1) / n_there
    u, v = _tangents(normals)
    a, b = np.einsum("vkc,vc->vk", offset, u), np.einsum("vkc,vc->vk", offset, v)
    p, q = np.einsum("vkc,vc->vk", turned, u), np.einsum("vkc,vc->vk", turned, v)
    # Unknowns (Buu, Buv, Bvv) of p = Buu a + Buv b and q = Buv a + Bvv b.
    aa, ab, bb = (a * a).sum(1), (a * b).sum(1), (b * b).sum(1)
    zero = np.zeros(len(points_mm))
    system = np.array([[aa, ab, zero], [ab, aa + bb, ab], [zero, ab, bb]]).transpose(2, 0, 1)
    system = system + (1e-6 * (aa + bb) + 1e-12)[:, None, None] * np.eye(3)
    right = np.stack([(p * a).sum(1), (p * b + q * a).sum(1), (q * b).sum(1)], axis=1)
    form = np.linalg.solve(system, right[..., None])[..., 0]
    steepest = np.abs(form).max(axis=1)
    bound = 1.0 / (_TIGHTEST_RADIUS * np.maximum(spacing, 1e-9))
    form *= np.minimum(1.0, bound / np.maximum(steepest, 1e-9))[:, None]
    # Entries of Buu u u^T + Buv (u v^T + v u^T) + Bvv v v^T.
    rows, columns = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
    buu, buv, bvv = form.T[:, :, None]
    entries = (
        buu * u[:, rows] * u[:, columns]
        + buv * (u[:, rows] * v[:, columns] + v[:, rows] * u[:, columns])
        + bvv * v[:, rows] * v[:, columns]
    )
    return np.ascontiguousarray(entries), spacing


def _tangents(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors across each normal and across each other."""
    least = np.abs(normals).argmin(axis=1)
    u = np.cross(normals, np.eye(3)[least])
    u /= np.maximum(np.linalg.norm(u, axis=1, keepdims=True), 1e-300)
    return u, np.cross(normals, u)
