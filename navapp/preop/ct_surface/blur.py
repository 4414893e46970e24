"""A scanner's blur at a surface: by the normal's direction, and the shift of curved edges."""

import numpy as np
from scipy.sparse import csr_array

from navapp.geometry.mesh import IntArray, TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.ct_surface.cortex_model import Scan
from navapp.preop.volume import CtVolume

# A curve sharper than this is an edge of the mesh and no surface that a profile measures.
_SHARPEST_PER_MM = 0.25
_CURVATURE_ROUNDS = 5


def compute_axial_fractions(ct: CtVolume, normals: FloatArray) -> FloatArray:
    """(N,) cosine between normals and the slices' normal."""
    i, j = ct.lps_from_index[:3, 0], ct.lps_from_index[:3, 1]
    across = np.cross(i, j)
    share: FloatArray = normals @ (across / np.linalg.norm(across))
    return share


def compute_blur_shift_mm(
    mesh: TriangleMesh, neighbours: csr_array, ct: CtVolume, scan: Scan
) -> FloatArray:
    """(V,) how much further out a curved edge lies than its blurred profile says.

    Source: van Vliet and Verbeek 1994: blur moves an edge towards its centre of curvature by the
    variance times the mean curvature.
    """
    curvature = _mean_curvature(mesh, neighbours)
    shift: FloatArray = scan.blur_mm(compute_axial_fractions(ct, mesh.normals)) ** 2 * curvature
    return shift


def neighbours_of(faces: IntArray, n: int) -> csr_array:
    """(V, V) 1 where two vertices share an edge."""
    start = faces.ravel()
    end = np.roll(faces, -1, axis=1).ravel()
    matrix = csr_array((np.ones(2 * len(start)), (np.r_[start, end], np.r_[end, start])), (n, n))
    matrix.data[:] = 1.0
    return matrix


def _mean_curvature(mesh: TriangleMesh, neighbours: csr_array) -> FloatArray:
    """(V,) mean of the normal curvatures towards the neighbours, 1/mm; positive where convex."""
    pairs = neighbours.tocoo()
    step = mesh.vertices_mm[pairs.col] - mesh.vertices_mm[pairs.row]
    turn = mesh.normals[pairs.col] - mesh.normals[pairs.row]
    squared = np.maximum((step**2).sum(axis=1), 1e-9)
    total = np.bincount(pairs.row, (step * turn).sum(axis=1) / squared, neighbours.shape[0])
    degree = np.maximum(neighbours.sum(axis=1), 1.0)
    curvature: FloatArray = np.clip(
        total.astype(np.float64) / degree, -_SHARPEST_PER_MM, _SHARPEST_PER_MM
    )
    for _ in range(_CURVATURE_ROUNDS):
        curvature = (neighbours @ curvature + curvature) / (degree + 1.0)
    return curvature
