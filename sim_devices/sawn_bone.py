"""A bone after saw and drill: what is left of its skin, and the faces that the saw left."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_sections import clip_below, fill_section, find_piece, section_lines
from navapp.geometry.transform import FloatArray
from sim_devices.planned_cuts import Cut
from sim_devices.textures import make_smooth_noise

# The saw reaches so much further than its planned rectangle.
_REACH = 1.3
_FACE_STEP_MM = 1.0
_CORTEX_MM = 1.7
# Tooth marks: distance of the ridges, and their slope. They are in the normals only: the face
# itself is plane.
_TOOTH_MM, _TOOTH_SLOPE = 3.2, 0.07


@dataclass(frozen=True, slots=True, eq=False)
class SawnFace:
    """The face of a cut."""

    mesh: TriangleMesh  # plane; its normals have the relief of the saw's teeth
    cortex: FloatArray  # (V,) 0 to 1: 1 in the rim of hard bone, 0 where it is spongy


def cut_skin(bone: TriangleMesh, cuts: Sequence[Cut]) -> TriangleMesh:
    """The surface of a bone that its cuts leave, without their faces.

    Its first vertices are those of the bone; what lies beyond a cut belongs to no triangle.
    """
    for cut in cuts:
        bone = clip_below(bone, _removed_mm(bone, cut))
    return bone


def make_sawn_face(bone: TriangleMesh, cut: Cut, others: Sequence[Cut]) -> SawnFace | None:
    """The face that a cut leaves on a bone; None when nothing is left of it.

    Args:
        bone: intact, closed.
        cut: as it was made.
        others: further cuts that have been made in the same bone.
    """
    lines = section_lines(bone, _removed_mm(bone, cut))
    face = fill_section(lines, cut.normal, _FACE_STEP_MM)
    for other in others:
        if face is not None:
            heights_mm = other.heights_mm(face.vertices_mm)
            is_over = _is_over(face.vertices_mm, other)
            face = clip_below(face, np.where(is_over, heights_mm, np.minimum(heights_mm, -1.0)))
    if face is None or len(face.faces) == 0:
        return None
    marked = TriangleMesh(face.vertices_mm, face.faces, _tooth_normals(face.vertices_mm, cut))
    return SawnFace(marked, mark_cortex(bone, face.vertices_mm))


def mark_cortex(bone: TriangleMesh, points_mm: FloatArray) -> FloatArray:
    """(N,) 1 in the hard shell of a bone, 0 deeper inside, at points within it."""
    from scipy.spatial import cKDTree

    depth_mm = np.asarray(cKDTree(bone.vertices_mm).query(points_mm)[0])
    thickness_mm = _CORTEX_MM * (1.0 + 0.2 * make_smooth_noise(points_mm, 12.0, 4))
    mark: FloatArray = np.clip(0.5 + (thickness_mm - depth_mm) / 1.2, 0.0, 1.0)
    return mark


def _removed_mm(bone: TriangleMesh, cut: Cut) -> FloatArray:
    """(V,) mm by which vertices lie beyond a cut; -1 where its plane meets the bone elsewhere."""
    heights_mm = cut.heights_mm(bone.vertices_mm)
    is_piece = find_piece(bone, heights_mm, _is_over(bone.vertices_mm, cut))
    return np.where((heights_mm > 0.0) & ~is_piece, -1.0, heights_mm)


def _is_over(points_mm: FloatArray, cut: Cut) -> NDArray[np.bool_]:
    """(N,) whether the saw can reach over points."""
    along_mm = np.abs((points_mm - cut.point_mm) @ cut.axes.T)
    is_inside = along_mm <= 0.5 * _REACH * np.array(cut.extent_mm)
    return np.asarray(is_inside.all(axis=1))


def _tooth_normals(points_mm: FloatArray, cut: Cut) -> FloatArray:
    """(N, 3) unit normals of a face with faint ridges across the way of the blade."""
    across, along = cut.axes
    x, y = (points_mm - cut.point_mm) @ across, (points_mm - cut.point_mm) @ along
    # The blade swings about its handle: its marks are bent.
    phase = 2.0 * np.pi * (y + 0.004 * x * x) / _TOOTH_MM
    phase += 0.9 * make_smooth_noise(points_mm, 25.0, 6)
    depth = _TOOTH_SLOPE * np.clip(0.8 + 0.5 * make_smooth_noise(points_mm, 18.0, 7), 0.0, 1.5)
    normals = cut.normal + (depth * np.cos(phase))[:, None] * along
    unit: FloatArray = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return unit
