"""Cartilage on a bone: thickness and standard deviation per vertex, even or from a surface file.

The plan holds a thickness and its standard deviation per vertex; the bone itself stays as it is.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from navapp.errors import PlanError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_edges import open_border
from navapp.geometry.ply import read_ply
from navapp.geometry.transform import FloatArray
from navapp.preop.cut_ends import ends_of
from navapp.preop.surface_import import MIN_FACES, ImportedSurface, convert_to_lps
from navapp.values import BoneModel

# Thicker is none, and no even thickness may be larger.
LARGEST_MM = 10.0
# Standard deviation of a thickness that is known vertex by vertex: a surface file says nothing of
# its own. Assumed: about one voxel of the pictures (MRI) that cartilage is segmented in.
MAPPED_SD_MM = 0.4

# Along the bone's normals a surface is looked for so far, in and out.
_REACH_MM = 6.0
# Nearer than this two surfaces are the same one.
_COINCIDES_MM = 0.05
# Two segmentations cross where there is no cartilage; deeper, or more often, one of them is wrong.
_DIPS_MM, _DIPS_FRACTION = 0.5, 0.02


@dataclass(frozen=True, slots=True)
class CartilageFigures:
    """Cartilage of a bone in three numbers, over the vertices that have some."""

    # mean_mm, max_mm: thickness.
    mean_mm: float
    max_mm: float
    sd_mm: float  # root mean square of its standard deviation
    share: float  # of the bone's vertices


def figures_of(bone: BoneModel) -> CartilageFigures | None:
    """What the plan says of a bone's cartilage; None when it knows of none."""
    is_covered = (bone.cartilage_mm > 0.0) | (bone.cartilage_sd_mm > 0.0)
    if not is_covered.any():
        return None
    thickness, sd = bone.cartilage_mm[is_covered], bone.cartilage_sd_mm[is_covered]
    return CartilageFigures(
        float(thickness.mean()),
        float(thickness.max()),
        float(np.sqrt((sd**2).mean())),
        float(is_covered.mean()),
    )


def make_even_cartilage(bone: BoneModel, mean_mm: float, sd_mm: float) -> BoneModel:
    """The bone with one thickness everywhere but where its surface ends.

    Raises:
        ValueError: a value outside 0 to 10 mm.
    """
    if not (0.0 <= mean_mm <= LARGEST_MM and 0.0 <= sd_mm <= LARGEST_MM):
        raise ValueError(f"cartilage of {mean_mm} +- {sd_mm} mm is not possible")
    is_covered = ~ends_of(bone)
    return replace(
        bone,
        cartilage_mm=np.where(is_covered, mean_mm, 0.0),
        cartilage_sd_mm=np.where(is_covered, sd_mm, 0.0),
    )


def import_cartilage(bone: BoneModel, path: str | Path) -> ImportedSurface:
    """The bone with the cartilage whose outer surface a PLY file holds.

    The thickness of a vertex is the distance along its normal to that surface; 0 where there is
    none within 6 mm, or where it coincides with the bone. The surface may be a patch, several, or
    a closed one that follows the bare bone elsewhere; its triangles must look outward.

    Raises:
        InputError: the file is missing or damaged.
        PlanError: it holds no such surface, or one that lies inside the bone or elsewhere.
    """
    path = Path(path)
    mesh, header = read_ply(path)
    warnings: list[str] = []
    if len(mesh.faces) < MIN_FACES:
        raise PlanError(
            f"cartilage {path} of the {bone.name} has only {len(mesh.faces)} triangles",
            subject=str(path),
            remedy="export the cartilage's outer surface, not its points",
        )
    mesh = convert_to_lps(mesh, header, path, warnings)
    if not open_border(len(mesh.vertices_mm), mesh.faces).any() and mesh.volume_mm3() < 0.0:
        mesh = mesh.flip()
        warnings.append(f"{bone.name}: normals of the cartilage pointed inwards and were turned")
    _check_place(bone, mesh, path)
    distance = measure_distance_above(bone.mesh, mesh, _REACH_MM)
    _check_outside(bone, distance, path)
    thickness = np.where(distance > _COINCIDES_MM, distance, 0.0)
    covered = replace(
        bone,
        cartilage_mm=thickness,
        cartilage_sd_mm=np.where(thickness > 0.0, MAPPED_SD_MM, 0.0),
    )
    return ImportedSurface(covered, tuple(warnings))


def measure_distance_above(
    bone: TriangleMesh, surface: TriangleMesh, reach_mm: float
) -> FloatArray:
    """(V,) distance from each vertex along its normal to the nearest triangle that looks outward.

    Negative beneath the bone; NaN where there is none within reach either way.
    """
    import open3d

    middle = bone.centroid_mm
    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(
        open3d.core.Tensor.from_numpy((surface.vertices_mm - middle).astype(np.float32)),
        open3d.core.Tensor.from_numpy(surface.faces.astype(np.uint32)),
    )
    starts = bone.vertices_mm - middle - reach_mm * bone.normals
    rays = np.hstack([starts, bone.normals]).astype(np.float32)
    found = scene.list_intersections(open3d.core.Tensor.from_numpy(rays))
    ray, place = found["ray_ids"].numpy().astype(np.intp), found["t_hit"].numpy() - reach_mm
    corners = surface.vertices_mm[surface.faces[found["primitive_ids"].numpy().astype(np.intp)]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    counts = (np.abs(place) <= reach_mm) & (np.einsum("ij,ij->i", across, bone.normals[ray]) > 0.0)
    ray, place = ray[counts], place[counts]
    # The nearest one is written last.
    order = np.argsort(-np.abs(place), kind="stable")
    distance = np.full(len(bone.vertices_mm), np.nan)
    distance[ray[order]] = place[order]
    return distance


def _check_place(bone: BoneModel, mesh: TriangleMesh, path: Path) -> None:
    """Refuse the cartilage of another bone, or of another coordinate frame."""
    from scipy.spatial import cKDTree

    used = mesh.vertices_mm[np.unique(mesh.faces)]
    apart_mm = float(np.median(cKDTree(bone.mesh.vertices_mm).query(used)[0]))
    if apart_mm > _REACH_MM:
        raise PlanError(
            f"cartilage {path} lies {apart_mm:.3g} mm away from the {bone.name}",
            subject=str(path),
            remedy="export it in mm and in the coordinates of the bone's surface",
        )


def _check_outside(bone: BoneModel, distance_mm: FloatArray, path: Path) -> None:
    """Refuse a surface that is not the outer one of this bone's cartilage."""
    is_hit = np.isfinite(distance_mm)
    is_inside = is_hit & (distance_mm < -_DIPS_MM)
    if is_inside.sum() > _DIPS_FRACTION * is_hit.sum():
        raise PlanError(
            f"cartilage {path} lies inside the {bone.name}, by up to "
            f"{-np.nanmin(distance_mm):.1f} mm",
            subject=str(path),
            remedy="export the cartilage's outer surface, in the coordinates of the bone's surface",
        )
    if not (distance_mm[is_hit] > _COINCIDES_MM).any():
        raise PlanError(
            f"cartilage {path} lies nowhere outside the {bone.name}",
            subject=str(path),
            remedy="export the cartilage's outer surface with outward normals, or leave it out",
        )
