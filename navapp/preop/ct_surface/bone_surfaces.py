"""Surfaces of segmented bones, placed at the edge of the cortex by a model of the blur."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.simplify import simplify
from navapp.geometry.transform import FloatArray
from navapp.preop.ct_surface.blur import compute_axial_fractions
from navapp.preop.ct_surface.cortex_model import Scan, sample_positions_mm
from navapp.preop.ct_surface.isosurface import make_isosurface
from navapp.preop.ct_surface.profiles import make_cubic_interpolation, sample_along
from navapp.preop.ct_surface.refinement import refine_surface
from navapp.preop.ct_surface.scan_estimate import UNKNOWN_SCAN, estimate_scan
from navapp.preop.segmentation import Segmentation
from navapp.preop.volume import CtVolume, LabelVolume
from navapp.preop.volume.hounsfield import PADDING_HU

# How far a surface may be off in each round: a voxel of any threshold first.
_REACHES_MM = (1.5, 0.6, 0.6)
# Profiles that tell what the scanner did, drawn evenly from all bones.
_N_PROFILES = 1000
# The model that is worked with: what a camera can tell needs no more.
_WORKING_VERTICES, _WORKING_WITHIN_MM = 7000, 0.1
# What the surface's errors do to a pose, in edges of the longest kind of a voxel: simulated CTs of
# other protocols (docs/how/preop.md).
_POSE_SD_VOXELS = 0.08
# The flat end of a cut shaft: its rim is rounded by smoothing.
_CUT_VOXELS = 0.75
# No bone lies beside air, so that what is padding so near its surface cuts it.
_PADDING_VOXELS = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class BoneSurface:
    """Surface of one bone from a CT."""

    mesh: TriangleMesh  # LPS mm, closed, normals outward
    is_cut: NDArray[np.bool_]  # (V,) the flat end where the volume cuts the shaft: no anatomy
    is_measured: NDArray[np.bool_]  # (V,) the density there told the edge
    left_out: float = 0.0  # share of a label's volume that is in separate pieces


@dataclass(frozen=True, slots=True, eq=False)
class CtSurfaces:
    """Surfaces of all bones of a CT, with the scanner's estimated blur."""

    bones: Mapping[str, BoneSurface]  # by name
    scan: Scan  # density of cortex, and blur
    # standard deviation of the error that the surfaces' own errors cause in a pose.
    pose_sd_mm: float


def make_surfaces(
    found: Segmentation, tell: Callable[[str], None] = lambda step: None
) -> CtSurfaces:
    """The surface of each named bone.

    In each round the scanner is estimated on the surfaces so far, and they are moved with it:
    normals that lean make its blur look wider than it is.
    """
    tell("laying first surfaces")
    density = make_cubic_interpolation(found.ct)
    bones = {name: _first_surface(found, number) for name, number in found.names.items()}
    scan = UNKNOWN_SCAN
    for reach_mm in _REACHES_MM:
        tell("estimating the density of cortex and the blur of the scanner")
        scan = _scan(bones, found.ct, density, reach_mm, scan)
        for name, bone in bones.items():
            tell(f"finding the edge of the {name}")
            is_other = (found.bones > 0) & (found.bones != found.names[name])
            refined = refine_surface(
                bone.mesh, bone.is_cut, found.ct, is_other, density, scan, reach_mm
            )
            bones[name] = BoneSurface(refined.mesh, bone.is_cut, refined.is_measured)
    working = {name: _working(bone, found.ct) for name, bone in bones.items()}
    return CtSurfaces(working, scan, _POSE_SD_VOXELS * float(found.ct.spacing_mm.max()))


def make_label_surface(mask: NDArray[np.bool_], volume: LabelVolume) -> BoneSurface:
    """The surface of a ready segmentation: voxels are all that is known of it."""
    mesh, left_out = make_isosurface(mask, volume)
    surface = BoneSurface(mesh, _is_cut(mesh, volume), np.zeros(len(mesh.vertices_mm), dtype=bool))
    return replace(_working(surface, volume), left_out=left_out)


def _working(surface: BoneSurface, volume: CtVolume | LabelVolume) -> BoneSurface:
    """In as few triangles as keep every vertex within a tenth of a millimetre."""
    from scipy.spatial import cKDTree

    mesh = simplify(surface.mesh, _WORKING_VERTICES, _WORKING_WITHIN_MM)
    _, nearest = cKDTree(surface.mesh.vertices_mm).query(mesh.vertices_mm)
    return BoneSurface(mesh, _is_cut(mesh, volume), surface.is_measured[nearest])


def _first_surface(found: Segmentation, number: int) -> BoneSurface:
    mesh, _ = make_isosurface(found.bones == number, found.ct)
    return BoneSurface(mesh, _is_cut(mesh, found.ct), np.zeros(len(mesh.vertices_mm), dtype=bool))


def _scan(
    bones: Mapping[str, BoneSurface],
    ct: CtVolume,
    density: Callable[[FloatArray], FloatArray],
    reach_mm: float,
    start: Scan,
) -> Scan:
    points = np.concatenate([bone.mesh.vertices_mm[~bone.is_cut] for bone in bones.values()])
    normals = np.concatenate([bone.mesh.normals[~bone.is_cut] for bone in bones.values()])
    every = np.linspace(0, len(points) - 1, min(_N_PROFILES, len(points))).astype(np.intp)
    profiles = sample_along(points[every], normals[every], sample_positions_mm(), density)
    return estimate_scan(profiles, compute_axial_fractions(ct, normals[every]), reach_mm, start)


def _is_cut(mesh: TriangleMesh, volume: CtVolume | LabelVolume) -> NDArray[np.bool_]:
    """(V,) where the volume ends, or its padding begins: a CT that was resampled to other axes."""
    indices = volume.indices_of(mesh.vertices_mm)
    last = np.array(volume.size) - 1
    is_beyond = ((indices < _CUT_VOXELS) | (indices > last - _CUT_VOXELS)).any(axis=1)
    if isinstance(volume, CtVolume):
        ahead_mm = _PADDING_VOXELS * float(volume.spacing_mm.max())
        outside = volume.indices_of(mesh.vertices_mm + ahead_mm * mesh.normals)
        i, j, k = np.clip(np.rint(outside), 0, last).astype(np.intp).T
        is_beyond |= volume.hu[k, j, i] <= PADDING_HU
    return np.asarray(is_beyond)
