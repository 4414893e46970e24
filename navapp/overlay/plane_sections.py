"""Where a plane cuts a mesh, and how far the mesh lies beyond it; in the mesh's coordinates."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_sections import find_piece, section_lines
from navapp.geometry.transform import FloatArray
from navapp.values import ResectionPlane


@lru_cache(maxsize=64)
def cut_lines(mesh: TriangleMesh, plane: ResectionPlane) -> tuple[FloatArray, ...]:
    """Polylines (N, 3) in which a plane cuts a mesh; closed ones end as they begin.

    Only within the planned rectangle and a margin.
    """
    lines = section_lines(mesh, plane.heights_mm(mesh.vertices_mm))
    return tuple(part for line in lines for part in _inside(line, plane.is_over(line)))


@lru_cache(maxsize=64)
def depth_beyond(mesh: TriangleMesh, planes: tuple[ResectionPlane, ...]) -> FloatArray:
    """(V,) how far each vertex of the pieces that the planes take off lies beyond, mm; else 0.

    Of several planes the one furthest away counts.
    """
    beyond_mm = np.zeros(len(mesh.vertices_mm))
    for plane in planes:
        height_mm = plane.heights_mm(mesh.vertices_mm)
        is_cut = find_piece(mesh, height_mm, plane.is_over(mesh.vertices_mm))
        beyond_mm = np.maximum(beyond_mm, np.where(is_cut, height_mm, 0.0))
    return beyond_mm


def _inside(points: FloatArray, is_inside: NDArray[np.bool_]) -> list[FloatArray]:
    """The runs of at least two points that are inside."""
    ends = np.flatnonzero(np.diff(is_inside)) + 1
    runs = zip((0, *ends), (*ends, len(points)), strict=True)
    return [points[a:b] for a, b in runs if is_inside[a] and b - a > 1]
