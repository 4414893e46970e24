"""Finds where a bone's surface was cut: flat caps and open borders."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_edges import half_edges, open_border, pair_half_edges
from navapp.geometry.transform import FloatArray
from navapp.values import BoneModel

# Shafts of femur and tibia are 20 mm across at least. Smoothing takes some of a cap's rim.
_CAP_MM2, _CAP_WIDTH_MM = 250.0, 12.0
# From the highest to the lowest point of a cap's roughness; between a round surface (a half) and a
# plane (all) of twice the layer.
_LAYER_MM, _CAP_FRACTION = 0.4, 0.7
# A shaft is cut across the leg's axis (the plan's z), less 45 deg: whatever is flat there is a cap.
# Elsewhere a joint's facet may be as flat, which turns gently where a cut turns by a right angle:
# mean cosine between the cap's normal and those within a few layers below it.
_ACROSS, _RIM_LAYERS, _RIM_COSINE = 0.7, 6.0, 0.65
# Facets of the hull that are one: half a degree, a twentieth of a millimetre. The hull of a rough
# cap has several.
_SAME_FACET = np.array([0.01, 0.01, 0.01, 0.05])
_FACET_FRACTION = 0.1
# Open borders that are shorter are holes in a surface, not its end: 12 mm across.
_SHORTEST_CUT_MM = 40.0


def ends_of(bone: BoneModel) -> NDArray[np.bool_]:
    """(V,) vertices at which its surface ends, or that are cut away: no anatomy."""
    mesh = bone.mesh
    is_end: NDArray[np.bool_] = (
        bone.is_removed | on_flat_caps(mesh) | open_border(len(mesh.vertices_mm), mesh.faces)
    )
    return is_end


def anatomy_of(bone: BoneModel) -> TriangleMesh:
    """What of a bone's surface is the bone's own: without caps and what is cut away.

    Where these were, the surface is open. Nothing is left of a box.
    """
    is_kept = ~(bone.is_removed | on_flat_caps(bone.mesh))
    faces = bone.mesh.faces[is_kept[bone.mesh.faces].all(axis=1)]
    used = np.unique(faces)
    return TriangleMesh(
        bone.mesh.vertices_mm[used],
        np.searchsorted(used, faces).astype(np.int32),
        bone.mesh.normals[used],
    )


@lru_cache(maxsize=16)
def on_flat_caps(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices of flat ends, however oblique the cut was; read-only.

    A layer below a plane that touches a round surface holds twice the area when it is twice as
    thick, however it is curved; on a cap it holds little more. A cap rougher than the layer is not
    found.
    """
    is_cap = np.zeros(len(mesh.vertices_mm), dtype=bool)
    areas = mesh.face_areas_mm2()
    # A third of a triangle belongs to each corner: triangles within a layer have no more area than
    # its vertices have. Few directions need a closer look.
    owned = np.bincount(mesh.faces.ravel(), np.repeat(areas / 3.0, 3), len(is_cap))
    for normal in _hull_directions(mesh):
        height = mesh.vertices_mm @ normal
        depth = height.max() - height
        is_low = depth < _LAYER_MM
        if owned[is_low].sum() > _CAP_MM2 and _is_cap(mesh, areas, normal, depth):
            is_cap |= is_low
    is_cap.setflags(write=False)
    return is_cap


def on_cut_borders(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices on long open borders: where a cut was, not a stray hole."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    halves = pair_half_edges(mesh.faces)
    edges = half_edges(mesh.faces)[halves[halves[:, 1] < 0, 0]]
    n = len(mesh.vertices_mm)
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
    _, loop = connected_components(graph, directed=False)
    ends = mesh.vertices_mm[edges]
    length_mm = np.bincount(loop[edges[:, 0]], np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1), n)
    is_cut: NDArray[np.bool_] = length_mm[loop] > _SHORTEST_CUT_MM
    return is_cut


def find_whole_until_mm(
    along_mm: FloatArray, is_border: NDArray[np.bool_], from_mm: float
) -> float:
    """How far along a bone the slices across it are whole: to the cut, which may be oblique.

    Args:
        along_mm: (V,) of each vertex.
        is_border: (V,) on cut borders.
        from_mm: borders before it do not count.
    """
    cut_mm = along_mm[is_border & (along_mm > from_mm)]
    return float(cut_mm.min() if len(cut_mm) else along_mm.max())


def _hull_directions(mesh: TriangleMesh) -> FloatArray:
    """(N, 3) outward normals of the hull's large facets: a cut has the whole bone behind it."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(mesh.vertices_mm)
    except (QhullError, ValueError):  # flat, or hardly a surface
        return np.empty((0, 3))
    area = TriangleMesh(mesh.vertices_mm, hull.simplices).face_areas_mm2()
    # One number sorts faster than four.
    steps = np.rint(hull.equations / _SAME_FACET).astype(np.int64)
    steps -= steps.min(axis=0)
    _, group = np.unique(np.ravel_multi_index(steps.T, steps.max(axis=0) + 1), return_inverse=True)
    total = np.bincount(group, area)
    summed = [np.bincount(group, area * hull.equations[:, k]) for k in range(3)]
    large = np.column_stack(summed)[total > _FACET_FRACTION * _CAP_MM2]
    normals: FloatArray = large / np.linalg.norm(large, axis=1, keepdims=True)
    return normals


def _is_cap(mesh: TriangleMesh, areas: FloatArray, normal: FloatArray, depth: FloatArray) -> bool:
    """Whether what lies below a plane that touches the bone is a cut end."""
    near = np.flatnonzero((depth < _RIM_LAYERS * _LAYER_MM)[mesh.faces].all(axis=1))
    of_face = depth[mesh.faces[near]].max(axis=1)
    layer, twice = near[of_face < _LAYER_MM], near[of_face < 2.0 * _LAYER_MM]
    flat_mm2 = areas[layer].sum()
    if flat_mm2 <= max(_CAP_MM2, _CAP_FRACTION * areas[twice].sum()):
        return False
    corners = mesh.vertices_mm[mesh.faces[layer]]
    if _width_mm(corners, areas[layer]) <= _CAP_WIDTH_MM:
        return False
    if abs(normal[2]) > _ACROSS:
        return True
    rim = near[of_face >= 2.0 * _LAYER_MM]
    cosines = mesh.normals[mesh.faces[rim]].mean(axis=1) @ normal
    return len(rim) == 0 or bool(np.average(cosines, weights=areas[rim] + 1e-12) < _RIM_COSINE)


def _width_mm(corners_mm: FloatArray, weight: FloatArray) -> float:
    """Of the strip that is spread as much across as (F, 3, 3) triangles near a plane are."""
    points, weight = corners_mm.reshape(-1, 3), np.repeat(weight, 3)
    off = points - np.average(points, axis=0, weights=weight)
    variances = np.linalg.eigvalsh((off.T * weight) @ off / weight.sum())
    return float(np.sqrt(12.0 * variances[1]))
