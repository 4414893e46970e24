"""Moves the vertices of a bone's surface to the edges found in its density profiles."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.ct_surface.blur import (
    compute_axial_fractions,
    compute_blur_shift_mm,
    neighbours_of,
)
from navapp.preop.ct_surface.cortex_model import Scan, fit_edges, sample_positions_mm
from navapp.preop.ct_surface.profiles import sample_along
from navapp.preop.volume import CtVolume

# Samples are used up to half way to another bone, in these classes.
_UNTIL_MM = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
_BLUR_CLASSES = 5
# A profile that no plate explains: an osteophyte, a vessel, metal.
_WORST_RMS_HU = 200.0
# Offsets (not positions) are evened over neighbours so often: noise goes, edges stay.
_EVENING_ROUNDS = 2
_MOST_WEIGHT = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class RefinedSurface:
    """A surface whose vertices lie on the edge of the cortex."""

    mesh: TriangleMesh  # LPS mm
    # (V,) the profile there was explained; elsewhere neighbours say where it is.
    is_measured: NDArray[np.bool_]


def refine_surface(
    mesh: TriangleMesh,
    is_cut: NDArray[np.bool_],
    ct: CtVolume,
    is_other: NDArray[np.bool_],
    density: Callable[[FloatArray], FloatArray],
    scan: Scan,
    reach_mm: float,
) -> RefinedSurface:
    """Move each vertex along its normal to the edge in its profile.

    Args:
        mesh: near the surface.
        is_cut: (V,) where the volume ends, so that there is no edge.
        ct: the volume.
        is_other: (D, H, W) voxels of other bones.
        density: of LPS points (`profiles.make_cubic_interpolation`).
        scan: of this CT.
        reach_mm: how far off the mesh may be.
    """
    neighbours = neighbours_of(mesh.faces, len(mesh.vertices_mm))
    offset, weight = _measure_offsets(mesh, ct, is_other, density, scan, reach_mm)
    weight[is_cut] = 0.0
    is_measured = weight > 0.0
    even = _smooth_offsets(offset, weight, neighbours)
    even += np.where(is_measured, compute_blur_shift_mm(mesh, neighbours, ct, scan), 0.0)
    even[is_cut] = 0.0
    mesh = TriangleMesh(mesh.vertices_mm + even[:, None] * mesh.normals, mesh.faces)
    return RefinedSurface(mesh, is_measured)


def _measure_offsets(
    mesh: TriangleMesh,
    ct: CtVolume,
    is_other: NDArray[np.bool_],
    density: Callable[[FloatArray], FloatArray],
    scan: Scan,
    reach_mm: float,
) -> tuple[FloatArray, FloatArray]:
    """Offset and weight of each vertex."""
    positions = sample_positions_mm()
    profiles = sample_along(mesh.vertices_mm, mesh.normals, positions, density)
    blur = scan.blur_mm(compute_axial_fractions(ct, mesh.normals))
    blur_class = np.digitize(blur, np.linspace(blur.min(), blur.max(), _BLUR_CLASSES + 1)[1:-1])
    until_class = _until_class(mesh, ct, is_other)
    offset, weight = (np.zeros(len(blur)) for _ in range(2))
    for a in np.unique(blur_class):
        for b in np.unique(until_class):
            some = (blur_class == a) & (until_class == b)
            if not some.any():
                continue
            edges = fit_edges(
                profiles[some], _UNTIL_MM[b], float(blur[some].mean()), scan, reach_mm
            )
            is_bad = edges.is_at_end | (edges.misfit_hu2 > _WORST_RMS_HU**2 * len(positions))
            offset[some] = edges.offset_mm
            weight[some] = np.where(is_bad, 0.0, edges.sharpness)
    typical = float(np.median(weight[weight > 0.0])) if (weight > 0.0).any() else 1.0
    return offset, np.minimum(weight / typical, _MOST_WEIGHT)


def _until_class(mesh: TriangleMesh, ct: CtVolume, is_other: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(V,) index into `_UNTIL_MM`: half way to the next bone along the normal."""
    ahead = np.arange(0.0, 2.0 * _UNTIL_MM[-1], 0.25)
    points = mesh.vertices_mm[:, None] + ahead[:, None] * mesh.normals[:, None]
    voxels = np.rint(ct.indices_of(points.reshape(-1, 3))).astype(np.intp)
    voxels = np.clip(voxels, 0, np.array(ct.size) - 1)
    hits = is_other[voxels[:, 2], voxels[:, 1], voxels[:, 0]].reshape(len(points), -1)
    half_mm: FloatArray = np.where(hits.any(axis=1), 0.5 * ahead[hits.argmax(axis=1)], np.inf)
    return np.maximum(np.searchsorted(_UNTIL_MM, half_mm, side="right") - 1, 0)


def _smooth_offsets(values: FloatArray, weight: FloatArray, neighbours: csr_array) -> FloatArray:
    """(V,) weighted means over neighbours; what has no weight follows them."""
    degree = np.maximum(neighbours.sum(axis=1), 1.0)
    for _ in range(_EVENING_ROUNDS):
        total = neighbours @ (weight * values) + 2.0 * weight * values
        sum_of_weights = neighbours @ weight + 2.0 * weight
        values = np.where(sum_of_weights > 0.0, total / np.maximum(sum_of_weights, 1e-9), 0.0)
        weight = sum_of_weights / (2.0 + degree)
    return values
