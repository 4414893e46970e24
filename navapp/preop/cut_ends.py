"""Where a bone's surface ends without the bone ending: flat caps of cut shafts, open borders."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_edges import face_pairs
from navapp.geometry.transform import FloatArray
from navapp.values import BoneModel

# Shafts of femur and tibia are 20 mm across at least, and cut across: less 45 deg. Smoothing takes
# some of a cap's rim.
_CAP_MM2, _CAP_WIDTH_MM, _ACROSS = 250.0, 12.0, 0.7
# The roughness of caps; between a round surface (a half) and a plane (all) of twice the layer.
_LAYER_MM, _CAP_SHARE = 0.4, 0.7
# Facets of the hull that are one: half a degree, a twentieth of a millimetre. The hull of a rough
# cap has several.
_SAME_FACET = np.array([0.01, 0.01, 0.01, 0.05])
_FACET_SHARE = 0.1


def ends_of(bone: BoneModel) -> NDArray[np.bool_]:
    """(V,) vertices at which its surface ends, or that are cut away: no anatomy."""
    is_end: NDArray[np.bool_] = (
        bone.is_removed | on_flat_caps(bone.mesh) | on_open_borders(bone.mesh)
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


def on_flat_caps(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices of flat ends, however oblique the cut across the leg (the plan's z) was.

    A layer below a plane that touches a round surface holds twice the area when it is twice as
    thick, however it is curved; on a cap it holds little more.
    """
    is_cap = np.zeros(len(mesh.vertices_mm), dtype=bool)
    if len(mesh.faces) == 0:
        return is_cap
    area = _areas_mm2(mesh.vertices_mm, mesh.faces)
    for normal in _cap_directions(mesh):
        height = mesh.vertices_mm @ normal
        depth = height.max() - height
        of_face = depth[mesh.faces].max(axis=1)
        layer, twice = of_face < _LAYER_MM, of_face < 2.0 * _LAYER_MM
        is_flat = area[layer].sum() > max(_CAP_MM2, _CAP_SHARE * area[twice].sum())
        if is_flat and _width_mm(mesh.vertices_mm[mesh.faces[layer]], area[layer]) > _CAP_WIDTH_MM:
            is_cap |= depth < _LAYER_MM
    return is_cap


def on_open_borders(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices on an edge of one triangle only."""
    edges, faces = face_pairs(mesh.faces)
    is_border = np.zeros(len(mesh.vertices_mm), dtype=bool)
    is_border[edges[faces[:, 1] < 0]] = True
    return is_border


def whole_until_mm(along_mm: FloatArray, is_border: NDArray[np.bool_], from_mm: float) -> float:
    """How far along a bone the slices across it are whole: to the cut, which may be oblique.

    Args:
        along_mm: (V,) of each vertex.
        is_border: (V,) on open borders.
        from_mm: borders before it do not count.
    """
    cut_mm = along_mm[is_border & (along_mm > from_mm)]
    return float(cut_mm.min() if len(cut_mm) else along_mm.max())


def _cap_directions(mesh: TriangleMesh) -> FloatArray:
    """(N, 3) outward normals of the hull's large facets: a cut has the whole bone behind it."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(mesh.vertices_mm)
    except QhullError:  # flat, or hardly a surface
        return np.array([[0.0, 0.0, 1.0]])
    area = _areas_mm2(mesh.vertices_mm, hull.simplices)
    _, group = np.unique(np.rint(hull.equations / _SAME_FACET), axis=0, return_inverse=True)
    group = group.ravel()
    total = np.bincount(group, area)
    summed = [np.bincount(group, area * hull.equations[:, k]) for k in range(3)]
    large = np.column_stack(summed)[total > _FACET_SHARE * _CAP_MM2]
    normals: FloatArray = large / np.linalg.norm(large, axis=1, keepdims=True)
    return normals[np.abs(normals[:, 2]) > _ACROSS]


def _areas_mm2(vertices_mm: FloatArray, faces: NDArray[np.int32]) -> FloatArray:
    corners = vertices_mm[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area: FloatArray = 0.5 * np.linalg.norm(across, axis=1)
    return area


def _width_mm(corners_mm: FloatArray, weight: FloatArray) -> float:
    """Of the strip that is spread as much across as (F, 3, 3) triangles near a plane are."""
    points, weight = corners_mm.reshape(-1, 3), np.repeat(weight, 3)
    off = points - np.average(points, axis=0, weights=weight)
    variances = np.linalg.eigvalsh((off.T * weight) @ off / weight.sum())
    return float(np.sqrt(12.0 * variances[1]))
