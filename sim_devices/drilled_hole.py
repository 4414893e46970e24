"""The hole that is drilled into a bone for a guide."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from sim_devices.tools import across

HOLE_RADIUS_MM = 4.5
HOLE_DEPTH_MM = 25.0


def find_entry_point(femur: TriangleMesh, beside_mm: FloatArray, axis: FloatArray) -> FloatArray:
    """(3,) where a line along `axis` that passes beside a point first meets the bone."""
    u, v = across(axis)
    offset = femur.vertices_mm - beside_mm
    near = np.hypot(offset @ u, offset @ v) < 2.5
    if not near.any():
        raise ValueError("the drill's line misses the bone")
    point: FloatArray = beside_mm + axis * float((offset[near] @ axis).min())
    return point


def drill_hole(
    bone: TriangleMesh, entry_mm: FloatArray, axis: FloatArray
) -> tuple[TriangleMesh, TriangleMesh, FloatArray]:
    """Cut a blind cylindrical hole.

    Outside the cylinder the surface stays what it was: triangles that its rim crosses are clipped
    in their own planes.

    Args:
        bone: closed.
        entry_mm: (3,) on the surface.
        axis: (3,) unit, into the bone.

    Returns:
        The bone without the entry's surface (its first vertices are the old ones), the hole's wall
        and bottom, and the depth in mm of every vertex of the wall below its rim.
    """
    u, v = across(axis)
    offset = bone.vertices_mm - entry_mm
    distance = np.hypot(offset @ u, offset @ v) - HOLE_RADIUS_MM
    # The far side of the bone lies in the same cylinder.
    reachable = np.abs(offset @ axis) < HOLE_DEPTH_MM - 8.0
    inside = (distance < 0.0) & reachable
    count = inside[bone.faces].sum(axis=1)
    crossing = np.flatnonzero((count > 0) & (count < 3))
    clipper = _Clipper(bone, inside, lambda points: _radius(points - entry_mm, u, v))
    for face in bone.faces[crossing]:
        clipper.clip([int(corner) for corner in face])
    vertices = np.concatenate([bone.vertices_mm, np.array(clipper.added).reshape(-1, 3)])
    normals = np.concatenate([bone.normals, np.array(clipper.added_normals).reshape(-1, 3)])
    faces = np.concatenate([bone.faces[count == 0], np.array(clipper.faces).reshape(-1, 3)])
    cut = TriangleMesh(vertices, faces.astype(np.int32), normals)
    rims = vertices[np.array(clipper.rims)]
    bottom = float(entry_mm @ axis) + HOLE_DEPTH_MM
    return cut, *_wall(rims, entry_mm, axis, bottom)


class _Clipper:
    """Keeps the part of triangles outside the cylinder; new vertices are shared along edges."""

    def __init__(
        self,
        bone: TriangleMesh,
        inside: NDArray[np.bool_],
        excess: Callable[[FloatArray], float],
    ) -> None:
        self._bone = bone
        self._inside = inside
        self._excess = excess
        self._known: dict[tuple[int, int], int] = {}
        self.added: list[FloatArray] = []
        self.added_normals: list[FloatArray] = []
        self.faces: list[list[int]] = []
        self.rims: list[tuple[int, int]] = []

    def clip(self, corners: list[int]) -> None:
        """Add what is left of one triangle."""
        while self._inside[corners[0]] or not self._inside[corners[2]]:
            corners = corners[1:] + corners[:1]
        # Now the first corner stays and the last one goes.
        first, second, third = corners
        if self._inside[second]:
            a, b = self._crossing(first, second), self._crossing(first, third)
            self.faces.append([first, a, b])
            self.rims.append((a, b))
        else:
            a, b = self._crossing(second, third), self._crossing(first, third)
            self.faces += [[first, second, a], [first, a, b]]
            self.rims.append((a, b))

    def _crossing(self, outer: int, inner: int) -> int:
        """Index of the vertex where the edge meets the cylinder."""
        key = (outer, inner)
        if key not in self._known:
            a, b = self._bone.vertices_mm[outer], self._bone.vertices_mm[inner]
            low, high = 0.0, 1.0
            for _ in range(30):
                middle = 0.5 * (low + high)
                if self._excess(a + middle * (b - a)) > 0.0:
                    low = middle
                else:
                    high = middle
            normals = self._bone.normals
            self.added.append(a + low * (b - a))
            self.added_normals.append((1.0 - low) * normals[outer] + low * normals[inner])
            self._known[key] = len(self._bone.vertices_mm) + len(self.added) - 1
        return self._known[key]


def _wall(
    rims: FloatArray, entry_mm: FloatArray, axis: FloatArray, bottom: float
) -> tuple[TriangleMesh, FloatArray]:
    """Strips from every piece (S, 2, 3) of the rim down to the level `bottom`, and the floor."""
    rows = 10
    share = np.linspace(0.0, 1.0, rows)[:, None, None]
    level = rims @ axis
    down = (bottom - level)[None, :, :] * share
    points = rims[None] + down[..., None] * axis
    index = np.arange(rows * len(rims) * 2).reshape(rows, len(rims), 2)
    a, b = index[:-1, :, 0].ravel(), index[:-1, :, 1].ravel()
    c, d = index[1:, :, 0].ravel(), index[1:, :, 1].ravel()
    # The rim runs with the bone on its left, so the wall faces the axis in the other direction.
    faces = np.concatenate([np.column_stack([b, a, c]), np.column_stack([b, c, d])])
    floor_middle = points.reshape(-1, 3)
    centre = len(floor_middle)
    ends = index[-1]
    fan = np.column_stack([ends[:, 1], ends[:, 0], np.full(len(ends), centre)])
    middle = entry_mm + axis * (bottom - entry_mm @ axis)
    vertices = np.concatenate([floor_middle, middle[None]])
    offset = vertices - entry_mm
    radial = offset - (offset @ axis)[:, None] * axis
    length = np.linalg.norm(radial, axis=1, keepdims=True)
    normals = np.where(length > 1e-6, -radial / np.maximum(length, 1e-6), -axis)
    mesh = TriangleMesh(vertices, np.concatenate([faces, fan]).astype(np.int32), normals)
    return mesh, np.append(down.ravel(), HOLE_DEPTH_MM)


def _radius(offset: FloatArray, u: FloatArray, v: FloatArray) -> float:
    return float(np.hypot(offset @ u, offset @ v)) - HOLE_RADIUS_MM
