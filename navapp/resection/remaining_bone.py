"""The bone that is left after cuts: what is gone is neither registered to nor judged."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.mesh_sections import clip_below, fill_section, find_piece, section_lines
from navapp.geometry.transform import FloatArray
from navapp.values import BoneModel, DrillAxis, MeasuredFace, Part, ResectionPlane
from navapp.values.part_shapes import part_mesh

# Rounding: a vertex so near to a face lies on it.
_ON_FACE_MM = 1e-3


class Cut(NamedTuple):
    """A cut that has been made."""

    plane: ResectionPlane  # as planned, or as measured
    unsure_mm: float  # bone so far below the plane may be gone as well


def heights_over(mesh: TriangleMesh, cut: Cut) -> FloatArray:
    """(V,) mm by which vertices lie beyond a cut, or beyond what is unsure below it.

    Above 0 are those of the piece that it takes off, and no others: parts of the bone that lie
    beyond its plane elsewhere have -1.
    """
    height_mm = cut.plane.heights_mm(mesh.vertices_mm) + cut.unsure_mm
    is_piece = find_piece(mesh, height_mm, cut.plane.is_over(mesh.vertices_mm))
    return np.where((height_mm > 0.0) & ~is_piece, -1.0, height_mm)


def remove_cuts(bone: BoneModel, cuts: Sequence[Cut]) -> BoneModel:
    """The bone without the pieces of its cuts, and without what is unsure beside them.

    Its mesh keeps all its vertices: what is gone is marked. A lid closes the bone below the cuts.
    """
    if not cuts:
        return bone
    mesh, lids = bone.mesh, []
    is_gone = np.zeros(len(mesh.vertices_mm), dtype=np.bool_)
    for cut in cuts:
        height_mm = heights_over(mesh, cut)
        is_gone |= height_mm > 0.0
        lid = fill_section(section_lines(mesh, height_mm), cut.plane.normal)
        lids += [] if lid is None else [lid]
    return _remove(bone, is_gone, lids)


def remove_holes(bone: BoneModel, holes: Sequence[DrillAxis], unsure_mm: float) -> BoneModel:
    """The bone without what drills took, as far down as they went, and what is unsure beside it."""
    if not holes:
        return bone
    points_mm = bone.mesh.vertices_mm
    is_gone = np.zeros(len(points_mm), dtype=np.bool_)
    for hole in holes:
        along_mm = (points_mm - hole.entry_mm) @ hole.direction
        away_mm = points_mm - hole.entry_mm - along_mm[:, None] * hole.direction
        is_beside = np.linalg.norm(away_mm, axis=1) < 0.5 * hole.diameter_mm + unsure_mm
        # The drill came from outside: whatever lies there over the entry is gone as well.
        is_gone |= is_beside & (np.abs(along_mm) < hole.depth_mm + unsure_mm)
    return _remove(bone, is_gone, [])


def cover_with_parts(bone: BoneModel, parts: Sequence[Part]) -> BoneModel:
    """The bone with parts where they are planned: they hide it, and nothing is matched on them."""
    if not parts:
        return bone
    covers = [part_mesh(part) for part in parts]
    return replace(bone, lid=join_meshes(*([] if bone.lid is None else [bone.lid]), *covers))


def _remove(bone: BoneModel, is_gone: NDArray[np.bool_], lids: list[TriangleMesh]) -> BoneModel:
    """Mark vertices (V,) as gone, and close the bone by its lid, by further ones and by the rim.

    The rim are triangles on the edge of what is gone: they hide what lies behind, too.
    """
    mesh = bone.mesh
    n_gone = is_gone[mesh.faces].sum(axis=1)
    rim = TriangleMesh(mesh.vertices_mm, mesh.faces[(n_gone > 0) & (n_gone < 3)], mesh.normals)
    lids = [*([] if bone.lid is None else [bone.lid]), rim, *lids]
    return replace(bone, is_removed=bone.is_removed | is_gone, lid=join_meshes(*lids))


def cut_surface(mesh: TriangleMesh, planes: Sequence[ResectionPlane]) -> TriangleMesh:
    """A bone's surface after cuts, with their faces: to be looked at."""
    skin, faces = mesh, []
    for plane in planes:
        height_mm = heights_over(mesh, Cut(plane, 0.0))
        face = fill_section(section_lines(mesh, height_mm), plane.normal)
        for other in planes:
            if face is not None and other is not plane:
                face = clip_below(face, _height_over_mm(face, other))
        faces += [] if face is None else [face]
        skin = clip_below(skin, heights_over(skin, Cut(plane, 0.0)))
    return join_meshes(skin, *faces)


def close_with_face(bone: BoneModel, face: MeasuredFace) -> BoneModel:
    """What a camera sees of a bone below a face, closed by the face: to be followed by it."""
    seen = bone.make_seen_surface()
    mesh = cut_surface(seen, [face.as_plane]).without_unused_vertices()
    _, nearest = cKDTree(seen.vertices_mm).query(mesh.vertices_mm)
    is_on_face = face.as_plane.heights_mm(mesh.vertices_mm) > -_ON_FACE_MM
    return BoneModel(
        bone.name,
        mesh,
        bone.side,
        cartilage_sd_mm=np.where(is_on_face, 0.0, bone.cartilage_sd_mm[nearest]),
        surface_sd_mm=bone.surface_sd_mm,
        face=face,
    )


def _height_over_mm(mesh: TriangleMesh, plane: ResectionPlane) -> FloatArray:
    """(V,) height over a plane; -1 beyond its planned rectangle."""
    height_mm = plane.heights_mm(mesh.vertices_mm)
    return np.where(plane.is_over(mesh.vertices_mm), height_mm, np.minimum(height_mm, -1.0))
