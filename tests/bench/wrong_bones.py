"""Models that are not quite the bone: of another size, of the other side, of another person."""

from dataclasses import replace

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.values import BoneModel

OTHER_SIDE = np.array([-1.0, 1.0, 1.0])  # factors that mirror a bone left to right


def stretch(mesh: TriangleMesh, factors: FloatArray | float) -> TriangleMesh:
    """Stretched along the axes (3,), or along all of them, about its middle."""
    factors = np.broadcast_to(factors, 3)
    vertices_mm = stretch_points(mesh.vertices_mm, mesh, factors)
    # Mirrored triangles are seen from the other side.
    return TriangleMesh(vertices_mm, mesh.faces if np.prod(factors) > 0.0 else mesh.faces[:, ::-1])


def stretch_points(
    points_mm: FloatArray, mesh: TriangleMesh, factors: FloatArray | float
) -> FloatArray:
    """Points (N, 3) that go with a mesh which is stretched."""
    centre_mm = mesh.centroid_mm
    return centre_mm + factors * (points_mm - centre_mm)


def stretch_bone(bone: BoneModel, factors: FloatArray | float) -> BoneModel:
    """A bone of the same name whose surface is stretched."""
    return replace(bone, mesh=stretch(bone.mesh, factors))


def move_onto(other: TriangleMesh, own: TriangleMesh) -> TriangleMesh:
    """Another mesh, its middle where that of the own one lies."""
    return TriangleMesh(other.vertices_mm + own.centroid_mm - other.centroid_mm, other.faces)
