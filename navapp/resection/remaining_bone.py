"""The bone that is left after cuts: what is gone is neither registered to nor judged."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.mesh_sections import fill_section, section_lines
from navapp.values import BoneModel, ResectionPlane

# A saw misses its plan: bone so near to a planned face may be gone, until the face is measured.
UNSURE_MM = 1.5


def remove_cuts(
    bone: BoneModel, planes: Sequence[ResectionPlane], unsure_mm: float = UNSURE_MM
) -> BoneModel:
    """The bone without what lies beyond the planes, and without a margin beside them.

    Its mesh keeps all its vertices: what is gone is marked. A lid closes the bone at the margin.

    Args:
        bone: as planned.
        planes: cuts that have been made, as planned or as measured.
        unsure_mm: width of the margin.
    """
    if not planes:
        return bone
    mesh = bone.mesh
    is_gone = np.zeros(len(mesh.vertices_mm), dtype=np.bool_)
    for plane in planes:
        is_gone |= _is_beyond(plane, mesh, unsure_mm)
    lids = [lid for plane in planes if (lid := _lid(plane, mesh, unsure_mm)) is not None]
    # Triangles on the margin's edge: they hide what lies behind, too.
    n_gone = is_gone[mesh.faces].sum(axis=1)
    rim = TriangleMesh(mesh.vertices_mm, mesh.faces[(n_gone > 0) & (n_gone < 3)], mesh.normals)
    return replace(
        bone,
        is_removed=bone.is_removed | is_gone,
        lid=join_meshes(rim, *lids),
        version=bone.version + len(planes),
    )


def _is_beyond(plane: ResectionPlane, mesh: TriangleMesh, unsure_mm: float) -> "np.ndarray":
    points_mm = mesh.vertices_mm
    return (plane.heights_mm(points_mm) > -unsure_mm) & plane.is_over(points_mm)


def _lid(plane: ResectionPlane, mesh: TriangleMesh, unsure_mm: float) -> TriangleMesh | None:
    """The bone's section below a planned face."""
    lines = section_lines(mesh, plane.heights_mm(mesh.vertices_mm) + unsure_mm)
    over = [line for line in lines if plane.is_over(line).all()]
    return fill_section(over, plane.normal)
