"""Imports a bone's surface from a file: one piece, outward normals, LPS, mm."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from navapp.errors import PlanError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import PlyHeader, read_ply
from navapp.geometry.simplify import is_closed
from navapp.values import BoneModel, Side

# A knee's bone end measures 35 (patella) to 500 mm (a whole femur) across.
_SMALLEST_MM, _LARGEST_MM = 25.0, 600.0
# Fewer triangles than this are no surface that was segmented.
MIN_FACES = 200


@dataclass(frozen=True, slots=True, eq=False)
class ImportedSurface:
    """A bone model and what had to be assumed or mended."""

    bone: BoneModel
    warnings: tuple[str, ...]


def import_surface(name: str, path: str | Path, side: Side | None = None) -> ImportedSurface:
    """Read one bone from a PLY file.

    Raises:
        InputError: the file is missing or damaged.
        PlanError: it holds no closed-up surface of a bone's size.
    """
    path = Path(path)
    mesh, header = read_ply(path)
    warnings: list[str] = []
    if len(mesh.faces) < MIN_FACES:
        raise PlanError(
            f"surface {path} of the {name} has only {len(mesh.faces)} triangles",
            subject=str(path),
            remedy="export the bone's surface, not its points",
        )
    mesh = convert_to_lps(mesh, header, path, warnings)
    whole = mesh.largest_component()
    if len(whole.faces) < MIN_FACES:
        raise PlanError(
            f"surface {path} of the {name} is in separate pieces of at most "
            f"{len(whole.faces)} triangles",
            subject=str(path),
            remedy="export one closed surface whose triangles have shared vertices",
        )
    _check_size(whole, name, path)
    if len(whole.faces) < len(mesh.faces):
        n_lost = len(mesh.faces) - len(whole.faces)
        warnings.append(f"{name}: {n_lost} triangles of separate pieces were left out")
    if whole.volume_mm3() < 0.0:
        whole = whole.flip()
        warnings.append(f"{name}: normals pointed inwards and were turned")
    if not is_closed(whole):
        warnings.append(
            f"{name}: the surface is open or has stray triangles; no edge is looked for there"
        )
    return ImportedSurface(BoneModel(name, whole, side), tuple(warnings))


def convert_to_lps(
    mesh: TriangleMesh, header: PlyHeader, path: Path, warnings: list[str]
) -> TriangleMesh:
    """The surface as LPS in mm, by what the file says of its space and unit.

    Raises:
        PlanError: it names another unit, or a space that is not known.
    """
    unit = (header.tag("UNIT") or "").lower()
    if unit not in ("", "mm"):
        raise PlanError(
            f"surface {path} says that its unit is {unit}",
            subject=str(path),
            remedy="export it in mm",
        )
    space = (header.tag("SPACE") or "").upper()
    if space == "RAS":
        turned = mesh.vertices_mm * np.array([-1.0, -1.0, 1.0])
        return TriangleMesh(turned, mesh.faces)
    if space == "":
        warnings.append(f"{path.name}: names no coordinate space, LPS is assumed")
    elif space != "LPS":
        raise PlanError(
            f"surface {path} is in the unknown space {space}",
            subject=str(path),
            remedy="export it in LPS or RAS",
        )
    return mesh


def _check_size(mesh: TriangleMesh, name: str, path: Path) -> None:
    longest_mm = float(mesh.size_mm.max())
    if _SMALLEST_MM <= longest_mm <= _LARGEST_MM:
        return
    hint = "export it in mm"
    for factor, unit in ((1000.0, "m"), (10.0, "cm"), (0.001, "micrometres")):
        if _SMALLEST_MM <= longest_mm * factor <= _LARGEST_MM:
            hint = f"it looks like {unit}, off by a factor of {factor:g}; export it in mm"
            break
    raise PlanError(
        f"surface {path} of the {name} is {longest_mm:.3g} mm long, which no knee bone is",
        subject=str(path),
        remedy=hint,
    )
