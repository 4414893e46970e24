"""The bone that is left after cuts: what is gone is neither registered to nor judged."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.mesh_sections import fill_section, section_lines
from navapp.values import BoneModel, ResectionPlane


class Cut(NamedTuple):
    """A cut that has been made."""

    plane: ResectionPlane  # as planned, or as measured
    unsure_mm: float  # bone so near to the plane may be gone as well


def remove_cuts(bone: BoneModel, cuts: Sequence[Cut]) -> BoneModel:
    """The bone without what lies beyond its cuts, and without what is unsure beside them.

    Its mesh keeps all its vertices: what is gone is marked. A lid closes the bone below the cuts.
    """
    if not cuts:
        return bone
    mesh = bone.mesh
    is_gone = np.zeros(len(mesh.vertices_mm), dtype=np.bool_)
    for plane, unsure_mm in cuts:
        is_beyond = plane.heights_mm(mesh.vertices_mm) > -unsure_mm
        is_gone |= is_beyond & plane.is_over(mesh.vertices_mm)
    lids = [lid for cut in cuts if (lid := _make_lid(cut, mesh)) is not None]
    # Triangles on the edge of what is unsure: they hide what lies behind, too.
    n_gone = is_gone[mesh.faces].sum(axis=1)
    rim = TriangleMesh(mesh.vertices_mm, mesh.faces[(n_gone > 0) & (n_gone < 3)], mesh.normals)
    return replace(bone, is_removed=bone.is_removed | is_gone, lid=join_meshes(rim, *lids))


def _make_lid(cut: Cut, mesh: TriangleMesh) -> TriangleMesh | None:
    """The bone's section where it is surely left; None without any."""
    plane, unsure_mm = cut
    lines = section_lines(mesh, plane.heights_mm(mesh.vertices_mm) + unsure_mm)
    return fill_section([line for line in lines if plane.is_over(line).all()], plane.normal)
