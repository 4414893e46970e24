"""Cartilage on a bone: what a camera sees above the surface that a CT shows.

The plan holds a thickness and its standard deviation per vertex; the bone itself stays as it is.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.values import BoneModel

LARGEST_MM = 10.0
# Standard deviation of a thickness that was measured vertex by vertex and names none: an
# assumption, about the voxel of the pictures (MRI) that cartilage is segmented from.
MAPPED_SD_MM = 0.4

# A flat end of a bone is where the CT or the export cut it off.
_FLAT_MM = 0.05
_SMALLEST_CAP_MM2 = 100.0


def even_cartilage(bone: BoneModel, mean_mm: float, sd_mm: float) -> BoneModel:
    """The bone with one thickness everywhere but at flat ends and open borders.

    Raises:
        ValueError: a value outside 0 to 10 mm.
    """
    if not (0.0 <= mean_mm <= LARGEST_MM and 0.0 <= sd_mm <= LARGEST_MM):
        raise ValueError(f"cartilage of {mean_mm} +- {sd_mm} mm is not possible")
    mesh = bone.mesh
    is_covered = ~(_on_open_borders(mesh) | _on_flat_ends(mesh))
    return replace(
        bone,
        cartilage_mm=np.where(is_covered, mean_mm, 0.0),
        cartilage_sd_mm=np.where(is_covered, sd_mm, 0.0),
    )


def _on_flat_ends(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices of flat ends across an axis of the plan: no bone ends in a plane."""
    corners = mesh.vertices_mm[mesh.faces]
    areas = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    is_end = np.zeros(len(mesh.vertices_mm), dtype=bool)
    for place in mesh.vertices_mm.T:
        for end_mm in (place.min(), place.max()):
            is_near = np.abs(place - end_mm) < _FLAT_MM
            if areas[is_near[mesh.faces].all(axis=1)].sum() > _SMALLEST_CAP_MM2:
                is_end |= is_near
    return is_end


def _on_open_borders(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """(V,) vertices on an edge of one triangle only."""
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    is_border = np.zeros(len(mesh.vertices_mm), dtype=bool)
    is_border[unique[counts == 1]] = True
    return is_border
