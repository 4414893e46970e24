"""Surfaces of primitives, and of planned parts, as meshes in the bone's coordinates."""

from functools import lru_cache

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.values.contents import Box, Cylinder, Part

_N_AROUND, _N_RINGS = 48, 16


@lru_cache(maxsize=64)
def part_mesh(part: Part) -> TriangleMesh:
    """A part's surface where it sits on its bone."""
    shape = part.shape
    if isinstance(shape, TriangleMesh):
        mesh = shape
    elif isinstance(shape, Box):
        mesh = _box(np.array(shape.size_mm))
    elif isinstance(shape, Cylinder):
        radius_mm, half_mm = 0.5 * shape.diameter_mm, 0.5 * shape.length_mm
        mesh = _turned(np.array([[0.0, -half_mm], [radius_mm, -half_mm], [radius_mm, half_mm],
                                 [0.0, half_mm]]))  # fmt: skip
    else:
        angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _N_RINGS + 1)
        radius_mm = 0.5 * shape.diameter_mm
        mesh = _turned(radius_mm * np.column_stack([np.cos(angles), np.sin(angles)]))
    return mesh.transform(part.bone_from_part)


def _box(size_mm: FloatArray) -> TriangleMesh:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return TriangleMesh(0.5 * signs * size_mm, np.array(faces, dtype=np.int32))


def _turned(profile_mm: FloatArray) -> TriangleMesh:
    """A profile (N, 2) of radius and height, from bottom to top, turned about z."""
    angles = 2.0 * np.pi * np.arange(_N_AROUND) / _N_AROUND
    rings = [
        np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(_N_AROUND, z)])
        for r, z in profile_mm
    ]
    faces = []
    for ring in range(len(profile_mm) - 1):
        for k in range(_N_AROUND):
            a, b = ring * _N_AROUND + k, ring * _N_AROUND + (k + 1) % _N_AROUND
            faces += [(a, b, b + _N_AROUND), (a, b + _N_AROUND, a + _N_AROUND)]
    return TriangleMesh(np.concatenate(rings), np.array(faces, dtype=np.int32))
