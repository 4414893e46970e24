"""Where a bone's surface ends without the bone ending: flat caps of cut shafts, open borders."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh

# A flat end of a bone is where the CT or the export cut it off.
_FLAT_MM = 0.05
_SMALLEST_END_MM2 = 100.0


def on_flat_ends(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices of flat ends across an axis of the plan: no bone ends in a plane."""
    corners = mesh.vertices_mm[mesh.faces]
    areas = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    is_end = np.zeros(len(mesh.vertices_mm), dtype=bool)
    for place in mesh.vertices_mm.T:
        for end_mm in (place.min(), place.max()):
            is_near = np.abs(place - end_mm) < _FLAT_MM
            if areas[is_near[mesh.faces].all(axis=1)].sum() > _SMALLEST_END_MM2:
                is_end |= is_near
    return is_end


def on_open_borders(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices on an edge of one triangle only."""
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    is_border = np.zeros(len(mesh.vertices_mm), dtype=bool)
    is_border[unique[counts == 1]] = True
    return is_border
