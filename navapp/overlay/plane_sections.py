"""Where a plane cuts a mesh, and how far the mesh lies beyond it; in the mesh's coordinates."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.values import ResectionPlane

# The planned rectangle is drawn; the cut may reach beyond it by this share, but not through other
# parts of the bone that the plane happens to meet.
_REACH = 1.3


@lru_cache(maxsize=64)
def cut_lines(mesh: TriangleMesh, plane: ResectionPlane) -> tuple[FloatArray, ...]:
    """Polylines (N, 3) in which a plane cuts a mesh; closed ones end as they begin.

    Only within the planned rectangle and a margin.
    """
    height_mm = _height_mm(mesh.vertices_mm, plane)
    starts, ends = _cut_edges(mesh.faces, height_mm)
    if len(starts) == 0:
        return ()
    chains = _chain(starts, ends)
    lines = []
    for chain in chains:
        low, high = np.array(chain).T
        share = height_mm[low] / (height_mm[low] - height_mm[high])
        points = mesh.vertices_mm[low]
        points = points + share[:, None] * (mesh.vertices_mm[high] - points)
        lines += _inside(points, _is_within(points, plane))
    return tuple(lines)


@lru_cache(maxsize=64)
def depth_beyond(mesh: TriangleMesh, planes: tuple[ResectionPlane, ...]) -> FloatArray:
    """(V,) how far each vertex lies beyond the plane furthest from it, mm; 0 where it stays."""
    beyond_mm = np.zeros(len(mesh.vertices_mm))
    for plane in planes:
        height_mm = _height_mm(mesh.vertices_mm, plane)
        is_cut = (height_mm > 0.0) & _is_within(mesh.vertices_mm, plane)
        beyond_mm = np.maximum(beyond_mm, np.where(is_cut, height_mm, 0.0))
    return beyond_mm


def _height_mm(points: FloatArray, plane: ResectionPlane) -> FloatArray:
    height: FloatArray = (points - plane.point_mm) @ plane.normal
    return height


def _is_within(points: FloatArray, plane: ResectionPlane) -> NDArray[np.bool_]:
    """(N,) points over the planned rectangle and a margin."""
    corners = plane.corners_mm()
    sides = np.stack([corners[1] - corners[0], corners[3] - corners[0]])
    half_mm = 0.5 * _REACH * np.linalg.norm(sides, axis=1)
    axes = sides / np.linalg.norm(sides, axis=1)[:, None]
    within: NDArray[np.bool_] = (np.abs((points - plane.point_mm) @ axes.T) <= half_mm).all(axis=1)
    return within


def _cut_edges(
    faces: NDArray[np.int32], height_mm: FloatArray
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """For each cut triangle the edge at which the plane enters it, and the one at which it leaves.

    An edge is named by its vertex below the plane and the one above.
    """
    above = height_mm[faces] > 0.0
    is_cut = above.any(axis=1) & ~above.all(axis=1)
    starts, ends = [], []
    for corners, is_above in zip(faces[is_cut].tolist(), above[is_cut].tolist(), strict=True):
        for k in range(3):
            here, there = corners[k], corners[(k + 1) % 3]
            if is_above[k] and not is_above[(k + 1) % 3]:
                starts.append((there, here))
            elif not is_above[k] and is_above[(k + 1) % 3]:
                ends.append((here, there))
    return starts, ends


def _chain(
    starts: list[tuple[int, int]], ends: list[tuple[int, int]]
) -> list[list[tuple[int, int]]]:
    """Edges in the order in which the plane meets them; triangles look the same way round."""
    following = dict(zip(starts, ends, strict=True))
    entered = set(ends)
    chains = []
    # Open lines begin at an edge that no triangle leads to.
    for first in [edge for edge in starts if edge not in entered] + starts:
        if first not in following:
            continue
        chain = [first]
        while chain[-1] in following:
            chain.append(following.pop(chain[-1]))
        chains.append(chain)
    return chains


def _inside(points: FloatArray, is_inside: NDArray[np.bool_]) -> list[FloatArray]:
    """The runs of at least two points that are inside."""
    ends = np.flatnonzero(np.diff(is_inside)) + 1
    runs = zip((0, *ends), (*ends, len(points)), strict=True)
    return [points[a:b] for a, b in runs if is_inside[a] and b - a > 1]
