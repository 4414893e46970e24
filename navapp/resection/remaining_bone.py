"""The bone that is left after cuts: what is gone is neither registered to nor judged."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.mesh_sections import clip_below, fill_section, section_lines
from navapp.geometry.transform import FloatArray
from navapp.values import BoneModel, ResectionPlane


class Cut(NamedTuple):
    """A cut that has been made."""

    plane: ResectionPlane  # as planned, or as measured
    unsure_mm: float  # bone so far below the plane may be gone as well


def find_piece(mesh: TriangleMesh, cut: Cut) -> FloatArray:
    """(V,) mm by which vertices lie beyond a cut: above 0 those of the piece that it takes off.

    A plane meets other parts of the bone, too, which stay (-1). The piece is what hangs together
    beyond it and lies over its planned rectangle. Beyond begins as far below the plane as is
    unsure.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    height_mm = cut.plane.heights_mm(mesh.vertices_mm) + cut.unsure_mm
    is_beyond = height_mm > 0.0
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    start, end = edges[is_beyond[edges].all(axis=1)].T
    n = len(height_mm)
    graph = coo_matrix((np.ones(len(start), dtype=np.int8), (start, end)), shape=(n, n))
    _, piece = connected_components(graph, directed=False)
    is_taken = np.isin(piece, piece[is_beyond & cut.plane.is_over(mesh.vertices_mm)])
    return np.where(is_beyond & ~is_taken, -1.0, height_mm)


def remove_cuts(bone: BoneModel, cuts: Sequence[Cut]) -> BoneModel:
    """The bone without the pieces of its cuts, and without what is unsure beside them.

    Its mesh keeps all its vertices: what is gone is marked. A lid closes the bone below the cuts.
    """
    if not cuts:
        return bone
    mesh, lids = bone.mesh, []
    is_gone = np.zeros(len(mesh.vertices_mm), dtype=np.bool_)
    for cut in cuts:
        height_mm = find_piece(mesh, cut)
        is_gone |= height_mm > 0.0
        lid = fill_section(section_lines(mesh, height_mm), cut.plane.normal)
        lids += [] if lid is None else [lid]
    # Triangles on the edge of what is unsure: they hide what lies behind, too.
    n_gone = is_gone[mesh.faces].sum(axis=1)
    rim = TriangleMesh(mesh.vertices_mm, mesh.faces[(n_gone > 0) & (n_gone < 3)], mesh.normals)
    return replace(bone, is_removed=bone.is_removed | is_gone, lid=join_meshes(rim, *lids))


def cut_surface(mesh: TriangleMesh, planes: Sequence[ResectionPlane]) -> TriangleMesh:
    """A bone's surface after cuts, with their faces: to be looked at."""
    skin, faces = mesh, []
    for plane in planes:
        height_mm = find_piece(mesh, Cut(plane, 0.0))
        face = fill_section(section_lines(mesh, height_mm), plane.normal)
        for other in planes:
            if face is not None and other is not plane:
                face = clip_below(face, _height_over_mm(face, other))
        faces += [] if face is None else [face]
        skin = clip_below(skin, find_piece(skin, Cut(plane, 0.0)))
    return join_meshes(skin, *faces)


def _height_over_mm(mesh: TriangleMesh, plane: ResectionPlane) -> FloatArray:
    """(V,) height over a plane; -1 beyond its planned rectangle."""
    height_mm = plane.heights_mm(mesh.vertices_mm)
    return np.where(plane.is_over(mesh.vertices_mm), height_mm, np.minimum(height_mm, -1.0))
